#include "colmap_ext/pipeline/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <system_error>

#include "phi/base/log.h"

namespace colmap_ext {
namespace {

constexpr std::chrono::milliseconds kBarInterval{200};
constexpr int kBarWidth = 30;

const char* Prefix(phi::LogLevel level) {
  switch (level) {
    case phi::LogLevel::kError:
      return "error: ";
    case phi::LogLevel::kWarning:
      return "warning: ";
    default:
      return "";
  }
}

}  // namespace

ProgressEstimator::ProgressEstimator(std::vector<double> weights) : stages_(weights.size()) {
  for (std::size_t i = 0; i < weights.size(); ++i) stages_[i].weight = weights[i];
}

void ProgressEstimator::SetNumTasks(int stage, int num_tasks) { stages_[stage].num_tasks = num_tasks; }

void ProgressEstimator::SetDone(int stage, int num_done, double seconds) {
  stages_[stage].num_done = num_done;
  stages_[stage].seconds = seconds;
}

double ProgressEstimator::SecondsPerWeight() const {
  double seconds = 0, weight = 0;
  for (const Stage& stage : stages_) {
    if (stage.num_done == 0) continue;
    seconds += stage.seconds;
    weight += stage.weight * stage.num_done;
  }
  return weight > 0 ? seconds / weight : 0;
}

double ProgressEstimator::SecondsPerTask(const Stage& stage) const {
  return stage.num_done > 0 ? stage.seconds / stage.num_done : stage.weight * SecondsPerWeight();
}

double ProgressEstimator::SecondsLeft() const {
  if (SecondsPerWeight() <= 0) return -1;
  double seconds = 0;
  for (const Stage& stage : stages_) seconds += SecondsPerTask(stage) * (stage.num_tasks - stage.num_done);
  return std::max(0.0, seconds);
}

double ProgressEstimator::Fraction() const {
  const double left = SecondsLeft();
  double spent = 0;
  int num_tasks = 0;
  for (const Stage& stage : stages_) {
    spent += stage.seconds;
    num_tasks += stage.num_tasks;
  }
  if (num_tasks == 0) return 1;
  return left < 0 ? 0 : spent / std::max(spent + left, 1e-9);
}

std::string FormatDuration(double seconds) {
  const long long whole = std::llround(std::max(0.0, seconds));
  const long long hours = whole / 3600, minutes = whole / 60 % 60;
  if (hours > 0) return std::to_string(hours) + " h " + std::to_string(minutes) + " min";
  if (minutes > 0) return std::to_string(minutes) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole) + " s";
}

ProgressLine::ProgressLine(std::vector<std::string> stage_names, std::vector<double> weights,
                           std::chrono::milliseconds line_interval)
    : terminal_(isatty(STDERR_FILENO) != 0 && phi::GetLogLevel() >= phi::LogLevel::kInfo),
      line_interval_(line_interval),
      names_(std::move(stage_names)),
      estimator_(weights),
      num_tasks_(weights.size(), 0) {
  if (terminal_) {
    phi::SetLogSink([this](phi::LogLevel level, const std::string& message) {
      std::fprintf(stderr, "\r\033[K%s%s\n", Prefix(level), message.c_str());
      DrawBar();
    });
  }
  try {
    thread_ = std::thread([this] { Loop(); });
  } catch (const std::system_error&) {  // the maps can be made without
    phi::LogDebug("no thread for the progress line");
  }
}

ProgressLine::~ProgressLine() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (terminal_) {
    phi::SetLogSink(nullptr);
    std::fprintf(stderr, "\r\033[K");
  }
}

void ProgressLine::SetNumTasks(int stage, int num_tasks) {
  std::lock_guard<std::mutex> lock(mutex_);
  num_tasks_[stage] = num_tasks;
  estimator_.SetNumTasks(stage, num_tasks);
}

void ProgressLine::BeginStage(int stage) {
  std::lock_guard<std::mutex> lock(mutex_);
  UpdateStage();
  stage_ = stage;
  num_done_ = 0;
  stage_begin_ = std::chrono::steady_clock::now();
}

void ProgressLine::TaskDone() {
  std::lock_guard<std::mutex> lock(mutex_);
  ++num_done_;
  UpdateStage();
}

void ProgressLine::UpdateStage() {
  if (stage_ < 0) return;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - stage_begin_;
  estimator_.SetDone(stage_, num_done_, elapsed.count());
}

std::string ProgressLine::Text() const {
  if (stage_ < 0) return "starting";
  char text[256];
  const double left = estimator_.SecondsLeft();
  std::snprintf(text, sizeof(text), "%.0f %%, %s %d of %d images, time left %s", 100 * estimator_.Fraction(),
                names_[stage_].c_str(), num_done_, num_tasks_[stage_],
                left < 0 ? "unknown" : FormatDuration(left).c_str());
  return text;
}

void ProgressLine::DrawBar() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (stop_) return;
  const int filled = static_cast<int>(kBarWidth * estimator_.Fraction());
  const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '.');
  std::fprintf(stderr, "\r\033[K[%s] %s", bar.c_str(), Text().c_str());
  std::fflush(stderr);
}

void ProgressLine::Loop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stop_) {
    stopped_.wait_for(lock, terminal_ ? kBarInterval : line_interval_, [this] { return stop_; });
    if (stop_) return;
    const std::string text = Text();
    lock.unlock();
    if (terminal_) {
      DrawBar();
    } else {
      phi::LogInfo("progress: " + text);
    }
    lock.lock();
  }
}

}  // namespace colmap_ext
