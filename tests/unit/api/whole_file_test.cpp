#include "api/program/whole_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <string>

#include "tests/support/temporary_directory.hpp"

namespace axisd::program {
namespace {

/// Stands for a full disk: no file grows beyond so many bytes.
class FullDisk {
 public:
  explicit FullDisk(rlim_t most) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit now{.rlim_cur = most, .rlim_max = before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &now);
  }
  FullDisk(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    (void)std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

class WholeFile : public testing::Test {
 protected:
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(directory_.path()),
                         std::filesystem::directory_iterator());
  }
  test::TemporaryDirectory directory_;
  std::string path_ = directory_ / "backup";
};

TEST_F(WholeFile, ReplacesAnOlderOne) {
  EXPECT_EQ(write_whole_file(path_, "older", 0600), 0);
  const std::string text(200'000, 'x');
  EXPECT_EQ(write_whole_file(path_, text, 0600), 0);
  EXPECT_EQ(directory_.read("backup"), text);
  EXPECT_EQ(std::filesystem::status(path_).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFile, AFullDiskLeavesTheOlderOneAndNothingElse) {
  ASSERT_EQ(write_whole_file(path_, "older", 0600), 0);
  {
    const FullDisk full(100);
    EXPECT_EQ(write_whole_file(path_, std::string(1000, 'x'), 0600), EFBIG);
  }
  EXPECT_EQ(directory_.read("backup"), "older");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFile, WhatCannotBeReplacedStays) {
  std::filesystem::create_directory(path_);
  EXPECT_EQ(write_whole_file(path_, "text", 0600), EISDIR);
  EXPECT_EQ(write_whole_file(directory_ / "missing/backup", "text", 0600), ENOENT);
  EXPECT_EQ(files(), 1);
}

}  // namespace
}  // namespace axisd::program
