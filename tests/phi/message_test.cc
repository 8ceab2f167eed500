// What errors and messages are about.
#include "phi/base/message.h"

#include <gtest/gtest.h>

#include <vector>

#include "phi/base/device_error.h"
#include "phi/base/log.h"

namespace phi {
namespace {

TEST(Message, KnowsWhichOfItsWordsAreNames) {
  const Message message = "cannot read " + AboutFile("my sparse: 2/images.bin") + " of image '" + AboutImage("b c.jpg") + "'; copy it";
  EXPECT_EQ(message.text, "cannot read my sparse: 2/images.bin of image 'b c.jpg'; copy it");
  EXPECT_EQ(message.file, "my sparse: 2/images.bin");
  EXPECT_EQ(message.image, "b c.jpg");
  EXPECT_EQ(message.stage, "");
}

TEST(Message, IsAboutTheFirstOfSeveral) {
  const Message message = AboutFile("a.bin") + " does not fit " + AboutFile("b.bin");
  EXPECT_EQ(message.text, "a.bin does not fit b.bin");
  EXPECT_EQ(message.file, "a.bin");
}

TEST(Message, TakesFromItsContextWhatItDoesNotName) {
  const Message message = WithContext(AboutImage("own") + ": too small", AboutImage("other") + AboutStage("measured"));
  EXPECT_EQ(message.text, "own: too small");
  EXPECT_EQ(message.image, "own");
  EXPECT_EQ(message.stage, "measured");
  EXPECT_EQ(message.file, "");
}

TEST(Error, CarriesItsMessage) {
  try {
    throw DeviceError("no memory in " + AboutStage("raw"));
  } catch (const Error& error) {
    const Error copy = error;
    EXPECT_STREQ(copy.what(), "no memory in raw");
    EXPECT_EQ(copy.message().text, "no memory in raw");
    EXPECT_EQ(copy.message().stage, "raw");
    EXPECT_EQ(copy.code(), ExitCode::kOutOfResources);
  }
}

TEST(Log, HandsOnWhatAMessageIsAbout) {
  std::vector<Message> told;
  SetLogSink([&](LogLevel, const Message& message) { told.push_back(message); });
  LogError(AboutImage("b c.jpg") + ": none of its sources can be read");
  SetLogSink({});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].image, "b c.jpg");
  EXPECT_EQ(told[0].text, "b c.jpg: none of its sources can be read");
}

}  // namespace
}  // namespace phi
