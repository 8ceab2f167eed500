#include "colmap_ext/fusion/flag_store.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "phi/base/error.h"

namespace colmap_ext {
namespace {

std::size_t NumBytes(std::size_t num_pixels) { return (num_pixels + 7) / 8; }

}  // namespace

FlagStore::FlagStore(std::filesystem::path folder, std::size_t num_images, std::uint8_t flag)
    : folder_(std::move(folder)), flag_(flag), offsets_(num_images, -1) {
  if (folder_.empty()) folder_ = ".";
}

FlagStore::~FlagStore() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FlagStore::Fail(const char* action) const {
  const phi::Message what =
      phi::AboutFile(folder_) + ": fusion cannot " + action + " its scratch file: " + std::strerror(errno);
  if (errno == ENOSPC || errno == EDQUOT || errno == EFBIG)
    throw phi::ResourceError(what + "; free some space");
  if (errno == EMFILE || errno == ENFILE || errno == ENOMEM)
    throw phi::ResourceError(what + "; raise the limit of open files (ulimit -n) or end other programs");
  throw phi::InputError(what);
}

void FlagStore::OpenScratchFile() {
  std::filesystem::create_directories(folder_);
  std::string name = (folder_ / ".phimvs-fusion-XXXXXX.tmp").string();
  constexpr int kSuffixLength = 4;
  descriptor_ = ::mkostemps(name.data(), kSuffixLength, O_CLOEXEC);
  if (descriptor_ < 0) Fail("create");
  // Without a name it goes away with the process, however that ends.
  ::unlink(name.c_str());
}

void FlagStore::Save(int image, const phi::FusionMap& map) {
  std::vector<std::uint8_t> bits(NumBytes(map.size()), 0);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if ((map.data()[i].flags & flag_) != 0) bits[i / 8] |= static_cast<std::uint8_t>(1u << (i % 8));
  }
  Save(image, bits);
}

void FlagStore::Save(int image, const std::vector<std::uint8_t>& bits) {
  if (descriptor_ < 0) OpenScratchFile();
  std::int64_t& offset = offsets_[static_cast<std::size_t>(image)];
  if (offset < 0) {
    offset = end_;
    end_ += static_cast<std::int64_t>(bits.size());
  }
  for (std::size_t done = 0; done < bits.size();) {
    const ssize_t written = ::pwrite(descriptor_, bits.data() + done, bits.size() - done,
                                     static_cast<off_t>(offset + static_cast<std::int64_t>(done)));
    if (written < 0 && errno != EINTR) Fail("write");
    if (written > 0) done += static_cast<std::size_t>(written);
  }
}

std::vector<std::uint8_t> FlagStore::Load(int image, std::size_t num_pixels) const {
  const std::int64_t offset = offsets_[static_cast<std::size_t>(image)];
  std::vector<std::uint8_t> bits(NumBytes(num_pixels));
  for (std::size_t done = 0; done < bits.size();) {
    const ssize_t got = ::pread(descriptor_, bits.data() + done, bits.size() - done,
                                static_cast<off_t>(offset + static_cast<std::int64_t>(done)));
    if (got == 0 || (got < 0 && errno != EINTR)) Fail("read");
    if (got > 0) done += static_cast<std::size_t>(got);
  }
  return bits;
}

void FlagStore::Restore(int image, phi::FusionMap* map) const {
  if (offsets_[static_cast<std::size_t>(image)] < 0) return;
  const std::vector<std::uint8_t> bits = Load(image, map->size());
  for (std::size_t i = 0; i < map->size(); ++i) {
    if ((bits[i / 8] >> (i % 8)) & 1u) map->data()[i].flags |= flag_;
  }
}

}  // namespace colmap_ext
