#include "api/web/gateway/users.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "api/web/gateway/passwords.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::web {
namespace {

using testing::HasSubstr;

const Users two{
    {.name = "shift-a", .role = "operator", .hash = "$argon2id$v=19$m=65536,t=2,p=1$c2FsdA$aGFzaA"},
    {.name = "panel-1", .role = "viewer", .hash = ""}};

TEST(Users, AreReadAsTheyAreWritten) {
  EXPECT_EQ(parse_users(to_text(two), "users").value(), two);
  EXPECT_EQ(parse_users("# nobody\n\n", "users").value(), Users{});
  EXPECT_EQ(find_user(two, "panel-1")->role, "viewer");
  EXPECT_EQ(find_user(two, "panel"), nullptr);
}

TEST(Users, AreRefusedWithTheLine) {
  for (const auto& [text, why] :
       {std::pair("a:viewer", "users:1: not NAME:ROLE:HASH"),
        std::pair("a:viewer:\nb b:viewer:", "users:2: no usable name"),
        std::pair("a:root:", "users:1: no role"), std::pair("a:viewer:secret", "users:1: no hash"),
        std::pair("a:viewer:\na:operator:", "users:2: a name for the second time")}) {
    const auto users = parse_users(text, "users");
    ASSERT_FALSE(users) << text;
    EXPECT_THAT(users.error().message, HasSubstr(why));
  }
}

TEST(Users, HaveNamesThatForgeNothing) {
  EXPECT_TRUE(is_user_name("shift-a"));
  for (const auto* name : {"", "a b", "a:b", "a\n", "\xC3\xA4"}) EXPECT_FALSE(is_user_name(name)) << name;
  EXPECT_FALSE(is_user_name(std::string(65, 'a')));
}

TEST(Users, WithAPasswordAreNobodyWhoComesWithACertificate) {
  EXPECT_EQ(role_of_certificate({{.name = "panel-1", .role = "operator", .hash = ""}}, "panel-1"),
            "operator");
  EXPECT_EQ(role_of_certificate(two, "shift-a"), "viewer");
  EXPECT_EQ(role_of_certificate(two, "stranger"), "viewer");
}

TEST(Users, CannotBeSavedWhereThereIsNoDirectoryYet) {
  const test::TemporaryDirectory directory;
  const auto saved = save_users((directory.path() / "axisd-web" / "users").string(), two);
  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().remedy, HasSubstr("systemctl start axisd-web"));
}

TEST(Users, HaveAFileOfTheirOwn) {
  const test::TemporaryDirectory directory;
  const auto path = (directory.path() / "users").string();
  EXPECT_EQ(load_users(path).value(), Users{}) << "nobody yet";
  ASSERT_TRUE(save_users(path, two));
  EXPECT_EQ(load_users(path).value(), two);
  struct stat about{};
  ASSERT_EQ(::stat(path.c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
  std::filesystem::permissions(path, std::filesystem::perms::group_read, std::filesystem::perm_options::add);
  EXPECT_EQ(load_users(path).error().reason, Reason::invalid_argument) << "others may read it";
  EXPECT_EQ(load_users("/dev/null").error().reason, Reason::invalid_argument);
}

TEST(Passwords, FitTheirHash) {
  ASSERT_TRUE(start_passwords());
  const auto hash = hash_of_password("correct horse");
  EXPECT_TRUE(hash.starts_with("$argon2id$"));
  EXPECT_TRUE(password_fits(hash, "correct horse"));
  EXPECT_FALSE(password_fits(hash, "correct horsf"));
  EXPECT_FALSE(password_fits("", "correct horse"));
  EXPECT_FALSE(password_fits(std::string(500, '$'), "correct horse"));
}

}  // namespace
}  // namespace axisd::web
