#include "colmap_ext/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "colmap_ext/terminal.h"
#include "phi/base/log.h"

namespace colmap_ext {
namespace {

constexpr std::chrono::milliseconds kBarInterval{250};
constexpr std::chrono::seconds kLongestLineInterval{60};
constexpr int kLineIntervalsInARun = 20;  // so many lines in a run of any length, or one a minute
constexpr int kMinBarWidth = 6, kMaxBarWidth = 30;

std::vector<double> Weights(const std::vector<ProgressStage>& stages) {
  std::vector<double> weights;
  for (const ProgressStage& stage : stages) weights.push_back(stage.weight);
  return weights;
}

// That understands the sequences that a redrawn line needs.
bool StderrIsTerminal() {
  const char* terminal = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && (terminal == nullptr || std::strcmp(terminal, "dumb") != 0);
}

// "1:05", "2:00:07"
std::string ClockTime(double seconds) {
  const long long whole = std::llround(std::max(0.0, seconds));
  char text[32];
  if (whole >= 3600) {
    std::snprintf(text, sizeof(text), "%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
  } else {
    std::snprintf(text, sizeof(text), "%lld:%02lld", whole / 60, whole % 60);
  }
  return text;
}

std::string Percent(double fraction) {
  return std::to_string(static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0) + 1e-6)) + " %";
}

std::string TimeLeft(const ProgressState& state) {
  return state.seconds_left < 0 ? "time left unknown" : FormatDuration(state.seconds_left) + " left";
}

std::string LineText(const ProgressState& s) {
  if (s.stage.empty()) return "starting";
  return Percent(s.fraction) + ", " + s.stage + " " + std::to_string(s.num_done) + " of " +
         std::to_string(s.num_tasks) + " " + s.unit + ", " + FormatDuration(s.seconds) + " so far, " +
         TimeLeft(s);
}

struct SharedSink {
  std::mutex mutex;
  ProgressSink sink;
};

SharedSink& Shared() {
  static SharedSink shared;
  return shared;
}

ProgressSink CurrentSink() {
  std::lock_guard<std::mutex> lock(Shared().mutex);
  return Shared().sink;
}

}  // namespace

void SetProgressSink(ProgressSink sink) {
  std::lock_guard<std::mutex> lock(Shared().mutex);
  Shared().sink = std::move(sink);
}

ProgressEstimator::ProgressEstimator(const std::vector<double>& weights) : stages_(weights.size()) {
  for (std::size_t i = 0; i < weights.size(); ++i) stages_[i].weight = weights[i];
}

void ProgressEstimator::SetNumTasks(int stage, int num_tasks) { stages_[stage].num_tasks = num_tasks; }

void ProgressEstimator::SetDone(int stage, double num_done, double seconds) {
  stages_[stage].num_done = num_done;
  stages_[stage].seconds = seconds;
}

double ProgressEstimator::SecondsPerWeight() const {
  double seconds = 0, weight = 0;
  for (const Stage& stage : stages_) {
    if (stage.num_done <= 0) continue;
    seconds += stage.seconds;
    weight += stage.weight * stage.num_done;
  }
  return weight > 0 ? seconds / weight : 0;
}

double ProgressEstimator::SecondsPerTask(const Stage& stage) const {
  return stage.num_done > 0 ? stage.seconds / stage.num_done : stage.weight * SecondsPerWeight();
}

double ProgressEstimator::SecondsSpent() const {
  double seconds = 0;
  for (const Stage& stage : stages_) seconds += stage.seconds;
  return seconds;
}

double ProgressEstimator::TaskSecondsLeft() const {
  double seconds = 0;
  for (const Stage& stage : stages_) seconds += SecondsPerTask(stage) * (stage.num_tasks - stage.num_done);
  return std::max(0.0, seconds);
}

double ProgressEstimator::SecondsLeft() const {
  if (SecondsPerWeight() <= 0) return -1;
  return TaskSecondsLeft() * elapsed_ / SecondsSpent();
}

double ProgressEstimator::Fraction() const {
  int num_tasks = 0;
  for (const Stage& stage : stages_) num_tasks += stage.num_tasks;
  if (num_tasks == 0) return 1;
  const double spent = SecondsSpent();
  return SecondsPerWeight() <= 0 ? 0 : spent / std::max(spent + TaskSecondsLeft(), 1e-9);
}

std::string FormatDuration(double seconds) {
  const long long whole = std::llround(std::max(0.0, seconds));
  const long long hours = whole / 3600, minutes = whole / 60 % 60;
  if (hours > 0) return std::to_string(hours) + " h " + std::to_string(minutes) + " min";
  if (minutes > 0) return std::to_string(minutes) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole) + " s";
}

std::string FormatBar(const ProgressState& s, int columns) {
  std::vector<std::string> parts = {Percent(s.fraction)};
  if (!s.stage.empty()) {
    parts.push_back(s.stage + " " + std::to_string(s.num_done) + "/" + std::to_string(s.num_tasks));
    parts.push_back(s.seconds_left < 0 ? "" : ClockTime(s.seconds_left) + " left");
  }
  parts.push_back(ClockTime(s.seconds) + " so far");
  std::string text;
  for (const std::string& part : parts) {
    if (part.empty()) continue;
    if (static_cast<int>(text.size() + 2 + part.size()) > columns) break;
    text += (text.empty() ? "" : ", ") + part;
  }
  const int room = columns - static_cast<int>(text.size()) - 3;  // two brackets and a space
  if (room < kMinBarWidth) return text;
  const int width = std::min(room, kMaxBarWidth);
  const int filled = static_cast<int>(width * std::clamp(s.fraction, 0.0, 1.0));
  return "[" + std::string(filled, '#') + std::string(width - filled, '.') + "] " + text;
}

ProgressLine::ProgressLine(std::vector<ProgressStage> stages, std::chrono::milliseconds line_interval)
    : sink_(CurrentSink()),
      terminal_(!sink_ && StderrIsTerminal() && phi::GetLogLevel() >= phi::LogLevel::kInfo),
      line_interval_(line_interval),
      stages_(std::move(stages)),
      estimator_(Weights(stages_)),
      counts_(stages_.size()) {
  if (terminal_) {
    phi::SetLogSink([this](phi::LogLevel level, const std::string& message) {
      {
        std::lock_guard<std::mutex> lock(mutex_);
        EraseBar();
        bar_length_ = 0;
        std::fprintf(stderr, "%s\n", phi::LogLine(level, message).c_str());
      }
      DrawBar();
    });
  }
  try {
    thread_ = std::thread([this] { Loop(); });
  } catch (const std::system_error&) {  // the work can be done without
    phi::LogDebug("no thread for the progress line");
  }
}

ProgressLine::ProgressLine(const ProgressStage& stage, std::size_t num_tasks)
    : ProgressLine(std::vector<ProgressStage>{stage}) {
  SetNumTasks(0, static_cast<int>(num_tasks));
}

ProgressLine::~ProgressLine() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
  if (sink_) sink_(State());
  if (terminal_) {
    phi::SetLogSink(nullptr);
    EraseBar();
    std::fflush(stderr);
  }
}

void ProgressLine::SetNumTasks(int stage, int num_tasks) {
  std::lock_guard<std::mutex> lock(mutex_);
  counts_[stage].num_tasks = num_tasks;
  estimator_.SetNumTasks(stage, num_tasks);
}

ProgressLine::Task::Task(ProgressLine* line, int stage) : line_(line), stage_(stage) {
  std::lock_guard<std::mutex> lock(line_->mutex_);
  if (!line_->first_begin_) line_->first_begin_ = line_->estimated_at_ = begin_;
  line_->running_.insert(this);
}

ProgressLine::Task::~Task() {
  std::lock_guard<std::mutex> lock(line_->mutex_);
  line_->running_.erase(this);
  Counts& counts = line_->counts_[stage_];
  ++counts.num_done;
  counts.seconds += std::chrono::duration<double>(Clock::now() - begin_).count();
  line_->UpdateEstimate();
}

void ProgressLine::Task::SetShare(double share) {
  std::lock_guard<std::mutex> lock(line_->mutex_);
  share_ = share;
  line_->UpdateEstimate();
}

// Of a task under way that tells no share nothing is known yet.
void ProgressLine::UpdateEstimate() {
  estimated_at_ = Clock::now();
  std::vector<double> done, seconds;
  for (const Counts& counts : counts_) {
    done.push_back(counts.num_done);
    seconds.push_back(counts.seconds);
  }
  for (const Task* task : running_) {
    if (!(task->share_ > 0)) continue;
    done[task->stage_] += task->share_;
    seconds[task->stage_] += std::chrono::duration<double>(estimated_at_ - task->begin_).count();
  }
  for (int s = 0; s < static_cast<int>(counts_.size()); ++s) estimator_.SetDone(s, done[s], seconds[s]);
  estimator_.SetElapsed(std::chrono::duration<double>(estimated_at_ - *first_begin_).count());
}

std::size_t ProgressLine::ShownStage() const {
  std::size_t stage = 0;
  while (stage + 1 < counts_.size() && counts_[stage].num_done >= counts_[stage].num_tasks) ++stage;
  return stage;
}

// Between two reports of what is done the time left runs down by the clock.
ProgressState ProgressLine::State() const {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> since_begin = now - begin_, since_estimate = now - estimated_at_;
  ProgressState state;
  state.seconds = since_begin.count();
  if (!first_begin_) return state;
  const std::size_t shown = ShownStage();
  state.stage = stages_[shown].name;
  state.unit = stages_[shown].unit;
  state.num_done = counts_[shown].num_done;
  state.num_tasks = counts_[shown].num_tasks;
  state.fraction = estimator_.Fraction();
  const double left = estimator_.SecondsLeft();
  if (left >= 0) state.seconds_left = std::max(0.0, left - since_estimate.count());
  return state;
}

// A bar that was drawn on a wider terminal may now take several rows.
void ProgressLine::EraseBar() const {
  const int num_rows_above = (static_cast<int>(bar_length_) - 1) / TerminalColumns(STDERR_FILENO);
  std::fprintf(stderr, "\r");
  if (num_rows_above > 0) std::fprintf(stderr, "\033[%dA", num_rows_above);
  std::fprintf(stderr, "\033[J");
}

void ProgressLine::DrawBar() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (stop_) return;
  const std::string bar =
      FormatBar(State(), TerminalColumns(STDERR_FILENO) - 1);  // a full row would move to the next
  EraseBar();
  bar_length_ = bar.size();
  std::fprintf(stderr, "%s", bar.c_str());
  std::fflush(stderr);
}

ProgressLine::Clock::duration ProgressLine::Interval() const {
  if (terminal_ || sink_) return kBarInterval;
  const Clock::duration share = (Clock::now() - begin_) / kLineIntervalsInARun;
  return std::max<Clock::duration>(line_interval_, std::min<Clock::duration>(share, kLongestLineInterval));
}

void ProgressLine::Loop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stop_) {
    stopped_.wait_for(lock, Interval(), [this] { return stop_; });
    if (stop_) return;
    const ProgressState state = State();
    lock.unlock();
    if (sink_) {
      sink_(state);
    } else if (terminal_) {
      DrawBar();
    } else {
      phi::LogInfo("progress: " + LineText(state));
    }
    lock.lock();
  }
}

}  // namespace colmap_ext
