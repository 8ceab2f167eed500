#include "colmap_ext/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "colmap_ext/dead_link.h"
#include "colmap_ext/file_locks.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporaryPrefix = ".phimvs-";
constexpr std::string_view kTemporarySuffix = ".tmp";
constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

// What the temporary names of this process begin with. Its number alone is another's too: in a container every command may be
// process 1. A child process after a fork has the token, but another number.
std::string OwnPrefix() {
  static const std::string token = [] {
    std::random_device random;
    char text[17];
    std::snprintf(text, sizeof(text), "%08x%08x", random(), random());
    return std::string(text);
  }();
  return std::string(kTemporaryPrefix) + std::to_string(::getpid()) + "-" + token + "-";
}

// Short and independent of the target's name, so that it exists wherever the target's name can.
fs::path NextTemporaryPath(const fs::path& target) {
  static std::atomic<std::uint64_t> counter{0};
  return target.parent_path() / (OwnPrefix() + std::to_string(counter.fetch_add(1)) + std::string(kTemporarySuffix));
}

// Of a file that is closed now and then the name tells its guard: A.tmp of A.B.tmp. Empty: it has none.
fs::path GuardOf(const fs::path& temporary) {
  const fs::path guarded = temporary.stem();
  return guarded.has_extension() ? temporary.parent_path() / (guarded.stem().string() + std::string(kTemporarySuffix)) : fs::path();
}

fs::path GuardedBy(const fs::path& guard, const fs::path& temporary) {
  const std::string number = temporary.stem().string().substr(OwnPrefix().size());
  return guard.parent_path() / (guard.stem().string() + "." + number + std::string(kTemporarySuffix));
}

// Whether a process writes it.
bool IsLocked(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool is_locked = ::flock(descriptor, LOCK_EX | LOCK_NB) != 0;
  ::close(descriptor);
  return is_locked;
}

bool IsShortageOfSpace(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

[[noreturn]] void ThrowWriteError(const fs::path& path, const std::string& action, int error) {
  const phi::Message what = phi::AboutFile(path) + ": cannot " + action + ": " + std::strerror(error);
  if (IsShortageOfSpace(error)) {
    throw phi::ResourceError(what +
                             "; free some space (nothing incomplete was left) and run the command again");
  }
  if (error == EMFILE || error == ENFILE || error == ENOMEM) {
    throw phi::ResourceError(what + "; raise the limit of open files (ulimit -n) or end other programs");
  }
  throw phi::InputError(what + "; check that the folder exists and can be written");
}

std::atomic<bool> g_keep_left_overs = false;

void RemoveLeftOversOnce(const fs::path& folder) {
  if (g_keep_left_overs) return;
  static std::mutex mutex;
  static std::set<fs::path> done;
  {
    std::lock_guard<std::mutex> lock(mutex);
    if (!done.insert(folder).second) return;
  }
  std::vector<fs::path> paths;  // removed after the walk, which must not see changes
  std::error_code error;
  for (fs::directory_iterator it(folder.empty() ? "." : folder, error), end; !error && it != end;
       it.increment(error)) {
    if (IsTemporaryFile(it->path())) paths.push_back(it->path());
  }
  for (const fs::path& path : paths) RemoveIfLeftOver(path);
}

// Follows links, also to a file that is not there yet.
fs::path FollowLinks(const fs::path& path) {
  constexpr int kMaxLinks = 40;
  fs::path target = path;
  std::error_code error;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(fs::symlink_status(target, error)); ++i) {
    const fs::path next = fs::read_symlink(target, error);
    if (error) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  if (fs::is_symlink(fs::symlink_status(target, error))) {
    throw phi::InputError(phi::AboutFile(path) + ": this link leads nowhere; give the name of a file");
  }
  return target;
}

void RefuseSpecialFile(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status) || fs::is_regular_file(status)) return;  // other errors come up when it is opened
  const std::string what = fs::is_directory(status) ? "a folder" : "a device or a pipe";
  throw phi::InputError(phi::AboutFile(path) + ": this is " + what +
                        ", which a file must not replace; give the name of a file");
}

}  // namespace

bool IsTemporaryFile(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with(kTemporaryPrefix) && name.ends_with(kTemporarySuffix);
}

bool SyncFile(int descriptor) {
  int result = 0;
  do {
    result = ::fsync(descriptor);
  } while (result != 0 && errno == EINTR);
  // Some file systems have no such call.
  return result == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP;
}

void SyncFileSystems(const std::set<fs::path>& folders) {
  std::set<dev_t> synced;
  for (const fs::path& folder : folders) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0 && errno == EACCES) {  // a folder that may be written but not read: all file systems
      ::sync();
      continue;
    }
    struct stat status = {};
    const bool is_known = descriptor >= 0 && ::fstat(descriptor, &status) == 0;
    const bool is_synced = is_known && (!synced.insert(status.st_dev).second || ::syncfs(descriptor) == 0);
    const int error = errno;
    if (descriptor >= 0) ::close(descriptor);
    if (!is_synced) ThrowWriteError(folder, "put the files on the disk", error);
  }
}

void SyncFolder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;  // a folder that may be written but not read
  const bool synced = SyncFile(descriptor);
  const int error = errno;
  ::close(descriptor);
  if (!synced) ThrowWriteError(folder, "put the folder on the disk", error);
}

void RemoveIfLeftOver(const fs::path& path) {
  if (!IsTemporaryFile(path)) return;
  // This process knows its own: results that wait for their names with others are closed, and hold no lock.
  if (path.filename().string().starts_with(OwnPrefix())) return;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return;
  const bool is_free = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  const fs::path guard = GuardOf(path);
  if (is_free && (guard.empty() || !IsLocked(guard))) ::unlink(path.c_str());
  ::close(descriptor);
}

void KeepLeftOvers() { g_keep_left_overs = true; }

OpenFiles::~OpenFiles() = default;

const AtomicFile& OpenFiles::GuardFor(const AtomicFile& file) {
  std::unique_ptr<AtomicFile>& guard = guards_[file.folder()];
  if (guard == nullptr) guard = std::make_unique<AtomicFile>(file.path(), Durability::kProcess);
  return *guard;
}

void OpenFiles::PutFirst(AtomicFile* file) {
  const auto place = std::find(open_.begin(), open_.end(), file);
  if (place != open_.end()) {
    open_.splice(open_.begin(), open_, place);
    return;
  }
  while (open_.size() >= max_open_) {
    open_.back()->MakeRoom();
    open_.pop_back();
  }
  open_.push_front(file);
}

void OpenFiles::Forget(AtomicFile* file) { open_.remove(file); }

AtomicFile::AtomicFile(const fs::path& path, Durability durability, std::shared_ptr<OpenFiles> open_files)
    : path_(path), target_(FollowLinks(path)), durability_(durability), open_files_(std::move(open_files)) {
  if (path_.filename().empty()) throw phi::InputError(phi::AboutFile(path_) + ": this is not a file name");
  RefuseSpecialFile(path_);
  std::error_code error;
  if (!folder().empty()) {
    fs::create_directories(folder(), error);
    if (const std::string dead = error ? DescribeDeadLink(folder()) : ""; !dead.empty()) {
      throw phi::InputError(phi::AboutFile(path_) + ": " + dead);
    }
    if (error) ThrowWriteError(path_, "create the folder", error.value());
  }
  RemoveLeftOversOnce(folder());
  if (open_files_ == nullptr) {
    Create();
    return;
  }
  const std::lock_guard<std::mutex> lock(open_files_->mutex_);
  guard_ = open_files_->GuardFor(*this).temporary_path();
  open_files_->PutFirst(this);
  try {
    Create();
  } catch (...) {
    open_files_->Forget(this);
    throw;
  }
}

void AtomicFile::Create() {
  for (;;) {
    temporary_ = NextTemporaryPath(target_);
    if (!guard_.empty()) temporary_ = GuardedBy(guard_, temporary_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    // A name may be taken by a process of another computer that shares the folder: try the next one.
    if (descriptor_ < 0 && (errno == EEXIST || errno == EINTR)) continue;
    if (descriptor_ < 0) ThrowWriteError(path_, "create the file", errno);
    // Another process may have taken it for a left-over before it was locked.
    const bool is_taken = ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!is_taken && !IsUnlinked(descriptor_)) return;
    ::close(descriptor_);
  }
}

AtomicFile::~AtomicFile() {
  CloseForGood();
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

bool AtomicFile::CloseForGood() {
  std::unique_lock<std::mutex> lock;
  if (open_files_ != nullptr) {
    lock = std::unique_lock<std::mutex>(open_files_->mutex_);
    open_files_->Forget(this);
  }
  const int descriptor = std::exchange(descriptor_, -1);
  return descriptor < 0 || ::close(descriptor) == 0;
}

std::unique_lock<std::mutex> AtomicFile::Use() {
  if (open_files_ == nullptr) return {};
  std::unique_lock<std::mutex> lock(open_files_->mutex_);
  open_files_->PutFirst(this);
  if (descriptor_ < 0) Reopen();
  return lock;
}

void AtomicFile::Reopen() {
  do {
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CLOEXEC);
  } while (descriptor_ < 0 && errno == EINTR);
  if (descriptor_ < 0 || ::lseek(descriptor_, static_cast<off_t>(bytes_in_file_), SEEK_SET) < 0) Fail("open the file again");
}

void AtomicFile::MakeRoom() {
  Flush();
  buffer_.shrink_to_fit();
  if (::close(std::exchange(descriptor_, -1)) != 0) Fail("write the file");
}

void AtomicFile::Fail(const char* action) {
  const int error = errno;
  ThrowWriteError(path_, action, error);
}

void AtomicFile::Write(const void* data, std::size_t num_bytes) {
  const auto use = Use();
  const char* bytes = static_cast<const char*>(data);
  bytes_written_ += num_bytes;
  if (buffer_.size() + num_bytes > kBufferBytes) Flush();
  if (num_bytes >= kBufferBytes) {
    WriteToFile(bytes, num_bytes);
  } else {
    buffer_.insert(buffer_.end(), bytes, bytes + num_bytes);
  }
}

void AtomicFile::WriteAt(std::uint64_t offset, const void* data, std::size_t num_bytes) {
  const auto use = Use();
  Flush();
  const char* bytes = static_cast<const char*>(data);
  while (num_bytes > 0) {
    const ssize_t written = ::pwrite(descriptor_, bytes, num_bytes, static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      Fail("write the file");
    }
    offset += static_cast<std::uint64_t>(written);
    bytes += written;
    num_bytes -= static_cast<std::size_t>(written);
  }
}

void AtomicFile::Flush() {
  WriteToFile(buffer_.data(), buffer_.size());
  buffer_.clear();
}

void AtomicFile::WriteToFile(const char* data, std::size_t num_bytes) {
  while (num_bytes > 0) {
    const ssize_t written = ::write(descriptor_, data, num_bytes);
    if (written < 0) {
      if (errno == EINTR) continue;
      Fail("write the file");
    }
    data += written;
    num_bytes -= static_cast<std::size_t>(written);
    bytes_in_file_ += static_cast<std::uint64_t>(written);
  }
  StartWriteBack();
}

// A file that waits for the disk in the end waits the less the earlier its bytes set out.
void AtomicFile::StartWriteBack() {
  constexpr std::uint64_t kPieceBytes = std::uint64_t{16} << 20;
  const std::uint64_t waiting = bytes_in_file_ - bytes_on_their_way_;
  if (durability_ != Durability::kPowerCut || waiting < kPieceBytes) return;
#ifdef SYNC_FILE_RANGE_WRITE
  // What goes wrong here shows when the file is synced.
  ::sync_file_range(descriptor_, static_cast<off_t>(bytes_on_their_way_), static_cast<off_t>(waiting), SYNC_FILE_RANGE_WRITE);
#endif
  bytes_on_their_way_ = bytes_in_file_;
}

fs::path AtomicFile::folder() const { return target_.parent_path(); }

void AtomicFile::Complete() {
  if (is_complete_) return;
  {
    const auto use = Use();
    Flush();
    is_complete_ = true;
    // Locked until it has its name. Network file systems report a full disk here.
    if (durability_ == Durability::kPowerCut && !SyncFile(descriptor_)) Fail("write the file");
  }
  if (durability_ == Durability::kProcess && !CloseForGood()) Fail("write the file");  // or here
}

void AtomicFile::Publish() {
  Complete();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) Fail("rename the finished file");
  temporary_.clear();
  CloseForGood();
}

void AtomicFile::Commit() {
  Publish();
  if (durability_ == Durability::kPowerCut) SyncFolder(folder());
}

void WriteFileAtomically(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.Write(content);
  file.Commit();
}

}  // namespace colmap_ext
