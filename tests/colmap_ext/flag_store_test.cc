#include "colmap_ext/fusion/flag_store.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "phi/base/error.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

// Not bad input: the caller can raise the limit.
TEST(FlagStore, TooManyOpenFilesAreALackOfResources) {
  const test_support::TemporaryFolder folder;
  FlagStore store(folder.path(), 1, 1);
  rlimit limit = {};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  const int next = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::close(next);
  const rlimit none_left = {static_cast<rlim_t>(next), limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none_left), 0);
  EXPECT_THROW(store.Save(0, phi::FusionMap(3, 2)), phi::ResourceError);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
  EXPECT_NO_THROW(store.Save(0, phi::FusionMap(3, 2)));
}

}  // namespace
}  // namespace colmap_ext
