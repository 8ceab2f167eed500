#include "colmap_ext/pipeline/thread_group.h"

#include <string>
#include <system_error>
#include <utility>

#include "phi/base/error.h"
#include "phi/base/log.h"

namespace colmap_ext {

void ThreadGroup::Start(std::function<void()> work) {
  try {
    threads_.emplace_back(std::move(work));
  } catch (const std::system_error& error) {
    throw phi::ResourceError(std::string("the system starts no more threads (") + error.code().message() +
                             "); end other programs of this user, or raise its limit (ulimit -u)");
  }
}

void ThreadGroup::StartIfPossible(std::function<void()> work) {
  try {
    Start(std::move(work));
  } catch (const phi::ResourceError& error) {
    phi::LogDebug(error.what());
  }
}

void ThreadGroup::Join() {
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace colmap_ext
