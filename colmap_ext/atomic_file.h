// Writes a file so that its final name never holds anything half-written: a temporary file beside the target,
// renamed by Commit(). Without Commit() the temporary is removed. Every file that phimvs leaves in a
// workspace goes this way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace colmap_ext {

// Temporary names are ".phimvs-<process>-<number>.tmp". A killed process may leave one; it is safe to delete.
bool IsTemporaryFile(const std::filesystem::path& path);

class AtomicFile {
 public:
  // Creates missing folders. Throws phi::InputError when the place cannot be written.
  explicit AtomicFile(const std::filesystem::path& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Buffered. Throws phi::ResourceError when the disk is full, phi::InputError on any other failure.
  void Write(const void* data, std::size_t num_bytes);
  void Write(std::string_view text) { Write(text.data(), text.size()); }

  // Replaces bytes that were written before, such as a count in a header that is known only at the end.
  void Overwrite(std::uint64_t offset, std::string_view text);

  std::uint64_t bytes_written() const { return bytes_written_; }

  // Flushes and checks that everything reached the file system; nothing can be written afterwards. For files that belong
  // together: all are completed before the first is committed.
  void Complete();
  // Completes if need be, and renames. The file is complete or an exception leaves.
  void Commit();

 private:
  void Flush();
  void WriteToFile(const char* data, std::size_t num_bytes);
  [[noreturn]] void Fail(const char* action);

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  std::uint64_t bytes_written_ = 0;
  std::vector<char> buffer_;
};

// The whole content at once.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view content);

}  // namespace colmap_ext
