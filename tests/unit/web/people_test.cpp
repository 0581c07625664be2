#include "api/web/gateway/people.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/temporary_directory.hpp"

namespace axisd::web {
namespace {

const Users one{{.name = "panel-1", .role = "viewer", .hash = ""}};

TEST(People, AreNobodyWhereThereIsNoFile) {
  const test::TemporaryDirectory directory;
  const auto path = (directory.path() / "users").string();
  auto people = People::load(path, false);
  ASSERT_TRUE(people);
  EXPECT_TRUE(people->nobody());
  EXPECT_FALSE(people->refresh());
  ASSERT_TRUE(save_users(path, one));
  EXPECT_TRUE(people->refresh());
  EXPECT_FALSE(people->nobody());
  std::filesystem::remove(path);
  EXPECT_FALSE(people->refresh()) << "a file that is gone lets nobody in, and nobody out";
  EXPECT_EQ(people->users(), one);
  ASSERT_TRUE(save_users(path, {}));
  EXPECT_TRUE(people->refresh());
  EXPECT_FALSE(people->nobody()) << "there was somebody";
}

TEST(People, AreAnErrorWhereTheFileThatIsNamedIsNotThere) {
  const test::TemporaryDirectory directory;
  const auto path = (directory.path() / "users").string();
  const auto people = People::load(path, true);
  ASSERT_FALSE(people);
  EXPECT_EQ(people.error().reason, Reason::invalid_argument);
  EXPECT_NE(people.error().message.find(path), std::string::npos);
  ASSERT_TRUE(save_users(path, {}));
  EXPECT_TRUE(People::load(path, true).value().nobody()) << "an empty file says so";
}

}  // namespace
}  // namespace axisd::web
