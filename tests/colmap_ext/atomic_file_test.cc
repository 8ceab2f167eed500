#include "colmap_ext/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/error_message.h"
#include "tests/support/temporary_folder.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;
using test_support::InputErrorOf;
using test_support::MessageOf;
using test_support::ReadBytes;
using test_support::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

int CountFiles(const fs::path& folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// The exit code of `action` in a process of its own.
int RunInChild(const std::function<int()>& action) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(action());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

enum ChildResult { kAsExpected = 10, kNotPermitted, kNoError, kWrongMessage, kLeftSomething, kTargetChanged };

// Writes a megabyte where it cannot go; expects a ResourceError that names the file and an unchanged folder.
int WriteTooMuch(const fs::path& target) {
  WriteFileAtomically(target, "before");
  try {
    WriteFileAtomically(target, std::string(1 << 20, 'x'));
    return kNoError;
  } catch (const phi::ResourceError& error) {
    if (std::string(error.what()).find(target.string()) == std::string::npos) return kWrongMessage;
  }
  if (CountFiles(target.parent_path()) != 1) return kLeftSomething;
  return ReadBytes(target) == "before" ? kAsExpected : kTargetChanged;
}

TEST(AtomicFileTest, AppearsWholeUnderItsNameOnCommit) {
  TemporaryFolder folder;
  const fs::path target = folder / "new/folder/name with é";
  AtomicFile file(target);
  file.Write("part one, ");
  EXPECT_FALSE(fs::exists(target));
  file.Write("part two");
  file.Commit();
  EXPECT_EQ(ReadBytes(target), "part one, part two");
  EXPECT_EQ(file.bytes_written(), 18u);
  EXPECT_EQ(CountFiles(target.parent_path()), 1);
}

TEST(AtomicFileTest, PiecesComeInAnyOrder) {
  TemporaryFolder folder;
  AtomicFile file(folder / "file");
  file.Write("head ");
  file.WriteAt(9, "third");
  file.WriteAt(5, "2nd ");
  EXPECT_EQ(file.bytes_written(), 5u);
  file.WriteAt(0, "HEAD");
  file.Commit();
  EXPECT_EQ(ReadBytes(folder / "file"), "HEAD 2nd third");
}

// Large enough that bytes set out for the disk before the end.
TEST(AtomicFileTest, LargeFilesAreWhole) {
  TemporaryFolder folder;
  std::string expected;
  {
    AtomicFile file(folder / "file");
    for (int i = 0; i < 40; ++i) {
      const std::string piece(std::size_t{1} << 20, static_cast<char>('a' + i % 26));
      file.Write(piece);
      expected += piece;
    }
    file.Commit();
  }
  EXPECT_TRUE(ReadBytes(folder / "file") == expected);
}

TEST(AtomicFileTest, LeavesTheOldFileWithoutCommit) {
  TemporaryFolder folder;
  const fs::path target = folder / "file";
  WriteFileAtomically(target, "old");
  {
    AtomicFile file(target);
    file.Write(std::string(1 << 20, 'x'));
    EXPECT_EQ(CountFiles(folder.path()), 2);
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      EXPECT_EQ(IsTemporaryFile(entry.path()), entry.path() != target);
    }
  }
  EXPECT_EQ(CountFiles(folder.path()), 1);
  EXPECT_EQ(ReadBytes(target), "old");
}

TEST(AtomicFileTest, KeepsTheOrderOfSmallAndLargePieces) {
  TemporaryFolder folder;
  const std::string large(300000, 'L'), medium(200000, 'M');
  AtomicFile file(folder / "file");
  for (const auto& piece : {std::string("s"), large, std::string("t"), medium, medium, std::string("u")}) {
    file.Write(piece);
  }
  file.Commit();
  EXPECT_EQ(ReadBytes(folder / "file"), "s" + large + "t" + medium + medium + "u");
}

TEST(AtomicFileTest, NamesTheFileThatCannotBeWritten) {
  TemporaryFolder folder;
  test_support::WriteBytes(folder / "file", "");
  EXPECT_THAT(InputErrorOf([&] { WriteFileAtomically(folder / "file/below", "x"); }),
              HasSubstr("file/below"));
  fs::create_directory(folder / "folder");
  EXPECT_THAT(InputErrorOf([&] { WriteFileAtomically(folder / "folder", "x"); }), HasSubstr("a folder"));
  EXPECT_EQ(CountFiles(folder.path()), 2);
}

// The renamed file would take the device's place for every program of the machine.
TEST(AtomicFileTest, RefusesDevicesAndPipesAndFollowsLinks) {
  TemporaryFolder folder;
  EXPECT_THAT(InputErrorOf([] { AtomicFile file("/dev/null"); }), HasSubstr("a device or a pipe"));
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(InputErrorOf([&] { AtomicFile file(folder / "pipe"); }), HasSubstr("a device or a pipe"));
  fs::create_directory(folder / "elsewhere");
  fs::create_symlink("elsewhere/target", folder / "first link");
  fs::create_symlink(folder / "first link", folder / "second link");
  for (const std::string content : {"new", "replaced"}) {
    WriteFileAtomically(folder / "second link", content);
    EXPECT_EQ(ReadBytes(folder / "elsewhere/target"), content);
  }
  EXPECT_TRUE(fs::is_symlink(folder / "first link") && fs::is_symlink(folder / "second link"));
  fs::create_symlink("loop", folder / "loop");
  EXPECT_THAT(InputErrorOf([&] { WriteFileAtomically(folder / "loop", "x"); }), HasSubstr("loop"));
  EXPECT_TRUE(fs::is_symlink(folder / "loop"));
}

TEST(AtomicFileTest, RemovesWhatAKilledProcessLeft) {
  TemporaryFolder folder;
  const fs::path left = folder / ".phimvs-1-5.tmp";
  test_support::WriteBytes(left, "half");
  AtomicFile writing(folder / "target");  // and the left-over goes
  EXPECT_FALSE(fs::exists(left));
  ASSERT_EQ(CountFiles(folder.path()), 1);
  const fs::path busy = fs::directory_iterator(folder.path())->path();
  RemoveIfLeftOver(busy);
  EXPECT_TRUE(fs::exists(busy)) << "it is being written";
  writing.Write("x");
  writing.Complete();
  RemoveIfLeftOver(busy);
  EXPECT_TRUE(fs::exists(busy)) << "it waits for its name";
  writing.Publish();
  RemoveIfLeftOver(folder / "target");
  AtomicFile waiting(folder / "with others", Durability::kProcess);
  waiting.Complete();  // closed: the first writer of another thread must not take it for a left-over
  for (const auto& entry : fs::directory_iterator(folder.path())) RemoveIfLeftOver(entry.path());
  waiting.Publish();
  EXPECT_TRUE(fs::exists(folder / "with others"));
  EXPECT_EQ(ReadBytes(folder / "target"), "x");
}

// In a container each is process 1. The first name is an earlier version's.
TEST(AtomicFileTest, RemovesWhatAKilledProcessOfTheSameNumberLeft) {
  TemporaryFolder folder;
  const std::string own = ".phimvs-" + std::to_string(::getpid());
  for (const char* rest : {"-5.tmp", "-0123456789abcdef-5.tmp"}) {
    const fs::path left = folder / (own + rest);
    test_support::WriteBytes(left, "half");
    RemoveIfLeftOver(left);
    EXPECT_FALSE(fs::exists(left)) << left;
  }
}

std::vector<std::unique_ptr<AtomicFile>> MakeFiles(const fs::path& folder, int count, const std::shared_ptr<OpenFiles>& open_files) {
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (int i = 0; i < count; ++i)
    files.push_back(std::make_unique<AtomicFile>(folder / std::to_string(i), Durability::kPowerCut, open_files));
  return files;
}

TEST(OpenFilesTest, MoreFilesThanAreOpenAreWhole) {
  constexpr int kNumFiles = 6;
  TemporaryFolder folder;
  const auto count_open = [&] {
    int count = 0;
    for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
      std::error_code gone;
      count += fs::read_symlink(entry.path(), gone).string().starts_with(folder.path().string());
    }
    return count;
  };
  std::vector<std::string> expected(kNumFiles);
  {
    const auto files = MakeFiles(folder.path(), kNumFiles, std::make_shared<OpenFiles>(2));
    for (int round = 0; round < 5; ++round) {
      for (int i = 0; i < kNumFiles; ++i) {
        const std::string piece((i + 1) * (round == 3 ? 100000 : 10), static_cast<char>('a' + round));
        files[i]->Write(piece);
        expected[i] += piece;
        EXPECT_LE(count_open(), 3) << "two, and the guard";
      }
    }
    for (int i = 0; i < kNumFiles; ++i) {
      files[i]->WriteAt(3, "HEAD");
      expected[i].replace(3, 4, "HEAD");
    }
    for (const auto& file : files) file->Complete();
    EXPECT_FALSE(fs::exists(folder / "0"));
    for (const auto& file : files) file->Commit();
  }
  for (int i = 0; i < kNumFiles; ++i) EXPECT_TRUE(ReadBytes(folder / std::to_string(i)) == expected[i]) << i;
  EXPECT_EQ(CountFiles(folder.path()), kNumFiles);
}

TEST(OpenFilesTest, TheOneWrittenLeastRecentlyIsClosed) {
  TemporaryFolder folder;
  const auto files = MakeFiles(folder.path(), 3, std::make_shared<OpenFiles>(2));
  const auto bytes_of = [&](int i) { return fs::file_size(files[static_cast<std::size_t>(i)]->temporary_path()); };
  files[0]->Write("first");
  files[1]->Write("second");
  files[0]->Write("again");
  files[2]->Write("third");
  EXPECT_EQ(bytes_of(1), 6u) << "what it had is written when it is closed";
  files[1]->Write("second");
  EXPECT_EQ(bytes_of(0), 10u);
  EXPECT_EQ(bytes_of(2), 0u);
}

// As another process does when it writes into the folder.
int RemoveAllLeftOvers(const fs::path& folder) {
  return RunInChild([&] {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::directory_iterator(folder)) paths.push_back(entry.path());
    for (const fs::path& path : paths) RemoveIfLeftOver(path);
    return static_cast<int>(kAsExpected);
  });
}

TEST(OpenFilesTest, NoOtherProcessTakesAClosedFileForALeftOver) {
  TemporaryFolder folder;
  {
    const auto files = MakeFiles(folder.path(), 3, std::make_shared<OpenFiles>(1));
    for (const auto& file : files) file->Write("one, ");
    ASSERT_EQ(CountFiles(folder.path()), 4);
    EXPECT_EQ(RemoveAllLeftOvers(folder.path()), kAsExpected);
    EXPECT_EQ(CountFiles(folder.path()), 4);
    for (const auto& file : files) file->Write("two");
    files[1]->Commit();
  }
  EXPECT_EQ(ReadBytes(folder / "1"), "one, two");
  EXPECT_EQ(CountFiles(folder.path()), 1) << "those without Commit() are gone, and so is the guard";
}

TEST(OpenFilesTest, WhatAKilledProcessLeftGoes) {
  TemporaryFolder folder;
  EXPECT_EQ(RunInChild([&] {
              const auto files = MakeFiles(folder.path(), 3, std::make_shared<OpenFiles>(1));
              for (const auto& file : files) file->Write("half");
              ::_exit(kAsExpected);
              return 0;
            }),
            kAsExpected);
  ASSERT_EQ(CountFiles(folder.path()), 4);
  EXPECT_EQ(RemoveAllLeftOvers(folder.path()), kAsExpected);
  EXPECT_EQ(CountFiles(folder.path()), 0);
}

// Maps may be put there, and their disk must not be asked for by a folder that nobody may open.
TEST(AtomicFileTest, FoldersThatMayBeWrittenButNotReadAreSynced) {
  constexpr ::uid_t kNobody = 65534;
  TemporaryFolder folder;
  const fs::path closed = folder / "closed";
  fs::create_directory(closed);
  EXPECT_EQ(RunInChild([&] {
              const bool is_root = ::geteuid() == 0;
              if (is_root && (::chown(folder.path().c_str(), kNobody, kNobody) != 0 || ::chown(closed.c_str(), kNobody, kNobody) != 0 ||
                              ::setuid(kNobody) != 0))
                return kNotPermitted;
              fs::permissions(closed, fs::perms::owner_write | fs::perms::owner_exec);
              const std::string message = MessageOf<phi::Error>([&] { SyncFileSystems({folder.path(), closed}); });
              fs::permissions(closed, fs::perms::owner_all);
              return message == "nothing was thrown" ? kAsExpected : kWrongMessage;
            }),
            kAsExpected);
}

TEST(AtomicFileTest, ReportsAFileSizeLimitAndCleansUp) {
  TemporaryFolder folder;
  EXPECT_EQ(RunInChild([&] {
              std::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit = {4096, 4096};
              ::setrlimit(RLIMIT_FSIZE, &limit);
              return WriteTooMuch(folder / "file");
            }),
            kAsExpected);
}

TEST(AtomicFileTest, ReportsAFullDiskAndCleansUp) {
  TemporaryFolder folder;
  const int result = RunInChild([&] {
    // A file system of 64 KiB, which only this process sees.
    if (::unshare(CLONE_NEWNS) != 0) return static_cast<int>(kNotPermitted);
    ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (::mount("none", folder.path().c_str(), "tmpfs", 0, "size=64k") != 0)
      return static_cast<int>(kNotPermitted);
    return WriteTooMuch(folder / "file");
  });
  if (result == kNotPermitted) GTEST_SKIP() << "mounting a small file system needs privileges";
  EXPECT_EQ(result, kAsExpected);
}

}  // namespace
}  // namespace colmap_ext
