#include "colmap_ext/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporaryPrefix = ".phimvs-";
constexpr std::string_view kTemporarySuffix = ".tmp";
constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

// Short and independent of the target's name, so that it exists wherever the target's name can.
fs::path NextTemporaryPath(const fs::path& target) {
  static std::atomic<std::uint64_t> counter{0};
  const std::string name = std::string(kTemporaryPrefix) + std::to_string(::getpid()) + "-" +
                           std::to_string(counter.fetch_add(1)) + std::string(kTemporarySuffix);
  return target.parent_path() / name;
}

bool IsShortageOfSpace(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

[[noreturn]] void ThrowWriteError(const fs::path& path, const std::string& action, int error) {
  const std::string what = path.string() + ": cannot " + action + ": " + std::strerror(error);
  if (IsShortageOfSpace(error)) {
    throw phi::ResourceError(what +
                             "; free some space (nothing incomplete was left) and run the command again");
  }
  throw phi::InputError(what + "; check that the folder exists and can be written");
}

}  // namespace

bool IsTemporaryFile(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with(kTemporaryPrefix) && name.ends_with(kTemporarySuffix);
}

AtomicFile::AtomicFile(const fs::path& path) : path_(path) {
  if (path_.filename().empty()) throw phi::InputError(path_.string() + ": this is not a file name");
  std::error_code error;
  if (!path_.parent_path().empty()) {
    fs::create_directories(path_.parent_path(), error);
    if (error) ThrowWriteError(path_, "create the folder", error.value());
  }
  // A name may be taken by a process of another computer that shares the folder: try the next one.
  do {
    temporary_ = NextTemporaryPath(path_);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && (errno == EEXIST || errno == EINTR));
  if (descriptor_ < 0) ThrowWriteError(path_, "create the file", errno);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::Fail(const char* action) {
  const int error = errno;
  ThrowWriteError(path_, action, error);
}

void AtomicFile::Write(const void* data, std::size_t num_bytes) {
  const char* bytes = static_cast<const char*>(data);
  bytes_written_ += num_bytes;
  if (buffer_.size() + num_bytes > kBufferBytes) Flush();
  if (num_bytes >= kBufferBytes) {
    WriteToFile(bytes, num_bytes);
  } else {
    buffer_.insert(buffer_.end(), bytes, bytes + num_bytes);
  }
}

void AtomicFile::Overwrite(std::uint64_t offset, std::string_view text) {
  Flush();
  while (!text.empty()) {
    const ssize_t written = ::pwrite(descriptor_, text.data(), text.size(), static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      Fail("write the file");
    }
    offset += static_cast<std::uint64_t>(written);
    text.remove_prefix(static_cast<std::size_t>(written));
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
  }
}

void AtomicFile::Complete() {
  if (descriptor_ < 0) return;
  Flush();
  // Network file systems report a full disk as late as here.
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (::close(descriptor) != 0) Fail("write the file");
}

void AtomicFile::Commit() {
  Complete();
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) Fail("rename the finished file");
  temporary_.clear();
}

void WriteFileAtomically(const fs::path& path, std::string_view content) {
  AtomicFile file(path);
  file.Write(content);
  file.Commit();
}

}  // namespace colmap_ext
