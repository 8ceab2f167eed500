#include "colmap_ext/terminal.h"

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace colmap_ext {
namespace {

TEST(Terminal, TellsItsColumns) {
  winsize size = {};
  size.ws_col = 100;
  size.ws_row = 24;
  int master = -1, slave = -1;
  ASSERT_EQ(openpty(&master, &slave, nullptr, nullptr, &size), 0);
  EXPECT_EQ(TerminalColumns(slave), 100);
  const int file = open("/dev/null", O_WRONLY);
  EXPECT_EQ(TerminalColumns(file), 80);
  for (const int stream : {master, slave, file}) close(stream);
}

TEST(Terminal, WrapsBetweenWords) {
  EXPECT_EQ(WrapText("one two three", 80, 2), "one two three");
  EXPECT_EQ(WrapText("one two three", 7, 2), "one two\n  three");
  EXPECT_EQ(WrapText("one two three", 6, 2), "one\n  two\n  three");
  EXPECT_EQ(WrapText("  --a --b", 7, 2), "  --a\n  --b");
  EXPECT_EQ(WrapText("a toolongword b", 6, 0), "a\ntoolongword\nb");
  EXPECT_EQ(WrapText("", 80, 2), "");
}

}  // namespace
}  // namespace colmap_ext
