#include "buses/regular_file.hpp"

#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

namespace axisd {
namespace {

using ::testing::HasSubstr;

class RegularFile : public ::testing::Test {
 protected:
  RegularFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "axisd-file-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~RegularFile() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;
};

TEST_F(RegularFile, IsReadWhole) {
  EXPECT_EQ(read_regular_file(write("some", std::string("a\0b", 3)), 100).value(), std::string("a\0b", 3));
  EXPECT_EQ(read_regular_file(write("none", ""), 100).value(), "");
  EXPECT_EQ(read_regular_file(write("full", std::string(100, 'x')), 100).value(), std::string(100, 'x'));
}

TEST_F(RegularFile, OfMoreThanIsTakenIsRefused) {
  const auto read = read_regular_file(write("much", std::string(2049, 'x')), 2048);
  EXPECT_THAT(to_string(read.error()), HasSubstr("much: has more than 2 KiB"));
}

TEST_F(RegularFile, WhatWaitsOrNeverEndsIsRefusedUnread) {
  const auto pipe = (folder_ / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& path : {pipe, std::string("/dev/zero"), std::string("/dev/ptmx"), folder_.string()})
    EXPECT_THAT(to_string(read_regular_file(path, 100).error()), HasSubstr("no regular file")) << path;
  EXPECT_THAT(to_string(read_regular_file((folder_ / "missing").string(), 100).error()),
              HasSubstr("cannot be read; check the path"));
}

}  // namespace
}  // namespace axisd
