// Writes that run one after the other on a thread of their own: who makes what is written goes on meanwhile.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace colmap_ext {

class WriteQueue {
 public:
  // Some milliseconds of writing, for which nothing new may come.
  static constexpr std::size_t kUsualBytes = std::size_t{32} << 20;

  // Of what waits to be written about so much is held, and one write more.
  explicit WriteQueue(std::size_t max_bytes = kUsualBytes) : max_bytes_(max_bytes) {}
  // Leaves out the writes that still wait.
  ~WriteQueue();
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;

  // `num_bytes`: that it writes. Waits while there is no room. Throws what a write before threw; none runs after it.
  void Add(std::size_t num_bytes, std::function<void()> write);
  // Waits until all writes are done. Throws as Add().
  void Finish();

 private:
  struct Item {
    std::size_t num_bytes;
    std::function<void()> write;
  };
  void Run();
  // Waits until condition() or a write has failed, and throws what that threw.
  template <typename Condition>
  void WaitUntil(std::unique_lock<std::mutex>* lock, const Condition& condition);

  const std::size_t max_bytes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> waiting_;
  std::size_t num_bytes_ = 0;  // of those that wait and the one that is being written
  bool is_writing_ = false;
  bool is_ending_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // from the first Add() on
};

}  // namespace colmap_ext
