#include "daemon/store/disk.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <string>

#include "buses/file_descriptor.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

TEST(Disk, SaysWhatToDoWhereItIsFull) {
  const FileDescriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  ASSERT_GE(full.get(), 0);
  const int error = write_all(full.get(), "line\n");
  EXPECT_EQ(error, ENOSPC);
  const Error told = disk_failed("write", "/var/lib/axisd/journal.v1", error).error();
  EXPECT_EQ(told.reason, Reason::storage);
  EXPECT_EQ(told.message, "cannot write /var/lib/axisd/journal.v1: No space left on device");
  EXPECT_EQ(told.remedy, "free space on the disk");
  EXPECT_EQ(told.where.native_code, static_cast<std::uint32_t>(ENOSPC));
}

TEST(Disk, SaysWhatToDoWhereItRefuses) {
  const Error told = disk_failed("create", "state.v1.new", EACCES).error();
  EXPECT_EQ(told.message, "cannot create state.v1.new: Permission denied");
  EXPECT_EQ(told.remedy, "check the disk and the directory's permissions");
}

TEST(Disk, TakesAllOfALongText) {
  const test::TemporaryDirectory directory;
  const auto path = directory.path() / "file";
  const std::string text(std::size_t{3} << 20U, 'x');
  {
    const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
    ASSERT_EQ(write_all(file.get(), text), 0);
  }
  EXPECT_EQ(directory.read("file"), text);
}

}  // namespace
}  // namespace axisd::store
