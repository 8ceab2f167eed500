// Every reader on its seeds and on seeds that were damaged at random, for a short time. scripts/fuzz does so for long, with
// a fuzzer that sees which code ran.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>
#include <string>

#include "phi/base/log.h"
#include "tests/fuzz/targets.h"

namespace {

using Clock = std::chrono::steady_clock;

std::chrono::duration<double> TimeForOneReader() {
  const char* text = std::getenv("PHIMVS_FUZZ_SECONDS");
  return std::chrono::duration<double>(text != nullptr ? std::atof(text) : 5);
}

constexpr double kLimitSeconds = 5;  // for one file

template <typename Action>
double TimeOf(const Action& action) {
  const auto begin = Clock::now();
  action();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Bytes that readers take for signs, limits and ends.
constexpr unsigned char kTelling[] = {0,   1,   9,   10,  13,  ' ',  '"',  '&', '-',
                                      '0', '9', '<', '[', '{', 0x7F, 0x80, 0xFF};

void Damage(std::mt19937& random, const std::string& other, std::string* text) {
  const auto at = [&](std::size_t size) { return size == 0 ? 0 : random() % size; };
  const std::size_t i = at(text->size());
  switch (random() % 6) {
    case 0:
      if (!text->empty()) (*text)[i] = static_cast<char>((*text)[i] ^ (1 << random() % 8));
      break;
    case 1:
      if (!text->empty()) (*text)[i] = static_cast<char>(kTelling[random() % std::size(kTelling)]);
      break;
    case 2:
      text->insert(i, 1 + random() % 8, static_cast<char>(kTelling[random() % std::size(kTelling)]));
      break;
    case 3:
      text->erase(i, 1 + random() % 16);
      break;
    case 4:
      text->insert(i, text->substr(at(text->size()), random() % 64));
      break;
    default:
      text->replace(i, random() % 32, other.substr(at(other.size()), random() % 32));
  }
}

class Readers : public ::testing::TestWithParam<fuzz::Target> {};

TEST_P(Readers, RefuseDamagedFilesAndDoNothingElse) {
  const fuzz::Target& target = GetParam();
  phi::SetLogSink([](phi::LogLevel, const std::string&) {});
  const auto run = [&](const std::string& text) {
    target.run({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  const std::vector<std::string> seeds = target.seeds();
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) run(seed);
  std::mt19937 random(1);
  int num_runs = 0;
  double longest = 0;
  const auto end = Clock::now() + TimeForOneReader();
  for (; Clock::now() < end; ++num_runs) {
    std::string text = seeds[random() % seeds.size()];
    for (std::size_t n = 1 + random() % 8; n > 0; --n) Damage(random, seeds[random() % seeds.size()], &text);
    double time = TimeOf([&] { run(text); });
    if (time > kLimitSeconds) time = TimeOf([&] { run(text); });  // the first time it may have waited for the processor
    longest = std::max(longest, time);
  }
  phi::SetLogSink({});
  EXPECT_LT(longest, kLimitSeconds);
  RecordProperty("runs", num_runs);
}

INSTANTIATE_TEST_SUITE_P(All, Readers, ::testing::ValuesIn(fuzz::Targets().begin(), fuzz::Targets().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
