// Writes a file so that its final name never holds anything half-written: a temporary file beside the target,
// renamed by Commit(). Without Commit() the temporary is removed. Every file that phimvs leaves in a
// workspace goes this way.
//
// A power cut changes nothing of this: the data is on the disk before the rename, and the rename before Commit() returns.
// Who publishes many files sees to both for all of them at once (MapStore).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string_view>
#include <vector>

namespace colmap_ext {

// Temporary names are ".phimvs-<process>-<random token of the process>-<number>.tmp". A killed process may leave one; it is safe
// to delete.
bool IsTemporaryFile(const std::filesystem::path& path);
// Removes it where it is one that a killed process left: other processes hold a lock on those that they write. AtomicFile does so for
// each folder that the process writes into, the first time.
void RemoveIfLeftOver(const std::filesystem::path& path);
// For the rest of this process they stay, since processes on other computers, whose locks are not seen here, write into the
// same folders.
void KeepLeftOvers();

enum class Durability {
  kPowerCut,  // waits for the disk
  kProcess,  // outlives the process only: for files that the same run removes again, or syncs together with others
};

// Puts an open file's data on the disk. False with errno set when that failed.
bool SyncFile(int descriptor);
// Puts everything that was written to the folders' file systems on the disk, each file system once: for many small files far
// cheaper than one after the other. Throws as AtomicFile::Write.
void SyncFileSystems(const std::set<std::filesystem::path>& folders);
// Puts the names of a folder's files on the disk. Does nothing where a file system knows no such thing.
void SyncFolder(const std::filesystem::path& folder);

class AtomicFile;

// For files that are written side by side and may be more than a process can hold open: which of them are. The one that was written
// least recently is closed when others need its place, and goes on where it was when it is written again.
class OpenFiles {
 public:
  explicit OpenFiles(std::size_t max_open) : max_open_(max_open) {}
  ~OpenFiles();
  OpenFiles(const OpenFiles&) = delete;
  OpenFiles& operator=(const OpenFiles&) = delete;

  std::size_t num_open() const { return open_.size(); }

 private:
  friend class AtomicFile;
  // The rest is called with the mutex locked. A closed file has no lock of its own: as long as that of its folder's guard is held, no
  // other process takes it for a left-over.
  const AtomicFile& GuardFor(const AtomicFile& file);
  void PutFirst(AtomicFile* file);
  void Forget(AtomicFile* file);

  const std::size_t max_open_;
  std::mutex mutex_;
  std::list<AtomicFile*> open_;  // the last written first
  std::map<std::filesystem::path, std::unique_ptr<AtomicFile>> guards_;
};

class AtomicFile {
 public:
  // Creates missing folders. A link's target is written, and the link stays. Throws phi::InputError when the place
  // cannot be written, or when it is a device, a pipe or a folder, which a file must not replace.
  // open_files: of which this is to be one; none: it stays open. Files of one may be written on any threads.
  explicit AtomicFile(const std::filesystem::path& path, Durability durability = Durability::kPowerCut,
                      std::shared_ptr<OpenFiles> open_files = nullptr);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Buffered. Throws phi::ResourceError when the disk is full, phi::InputError on any other failure.
  void Write(const void* data, std::size_t num_bytes);
  void Write(std::string_view text) { Write(text.data(), text.size()); }

  // At a place of the file, whatever Write has reached: a count in a header that is known only at the end, or pieces in any
  // order. Write goes on where it was.
  void WriteAt(std::uint64_t offset, const void* data, std::size_t num_bytes);
  void WriteAt(std::uint64_t offset, std::string_view text) { WriteAt(offset, text.data(), text.size()); }

  // By Write.
  std::uint64_t bytes_written() const { return bytes_written_; }

  // Flushes and checks that everything reached the disk; nothing can be written afterwards. For files that belong
  // together: all are completed before the first is published.
  void Complete();
  // Completes if need be, and renames. After a power cut the file is there or not; it is whole where it is.
  void Publish();
  // Publishes, and puts the new name on the disk. The file is there to stay or an exception leaves.
  void Commit();

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& temporary_path() const { return temporary_; }
  std::filesystem::path folder() const;

 private:
  friend class OpenFiles;
  void Create();
  // Opens it where it is closed. As long as the result is held, no other thread closes it.
  [[nodiscard]] std::unique_lock<std::mutex> Use();
  void Reopen();
  void MakeRoom();      // closes it, until Use()
  bool CloseForGood();  // false: errno says why not
  void Flush();
  void WriteToFile(const char* data, std::size_t num_bytes);
  void StartWriteBack();
  [[noreturn]] void Fail(const char* action);

  std::filesystem::path path_;    // as the user knows it
  std::filesystem::path target_;  // what a link at path_ leads to; else path_
  std::filesystem::path temporary_;
  std::filesystem::path guard_ = {};  // see OpenFiles; empty: none
  const Durability durability_;
  const std::shared_ptr<OpenFiles> open_files_;
  int descriptor_ = -1;
  bool is_complete_ = false;
  std::uint64_t bytes_written_ = 0;
  std::uint64_t bytes_in_file_ = 0, bytes_on_their_way_ = 0;  // that Write brought there; of these, to the disk
  std::vector<char> buffer_;
};

// The whole content at once.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view content);

}  // namespace colmap_ext
