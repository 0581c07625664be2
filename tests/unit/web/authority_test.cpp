#include "api/web/gateway/authority.hpp"

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "api/web/gateway/passwords.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::web {
namespace {

class Authorities : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(start_passwords());
    save("operator", "correct horse");
    people = std::make_unique<People>(People::load(path, true).value());
    authority = std::make_unique<PasswordAuthority>(*people, io.get_executor());
  }
  void save(const std::string& role, const std::string& password) {
    ASSERT_TRUE(save_users(path, {{.name = "anna", .role = role, .hash = hash_of_password(password)},
                                  {.name = "panel-1", .role = "operator", .hash = ""}}));
  }
  std::optional<Admitted> asked(
      const std::string& name, const std::string& secret, const std::function<void()>& meanwhile = [] {}) {
    std::optional<Admitted> said;
    bool answered = false;
    const auto guard = boost::asio::make_work_guard(io);
    EXPECT_TRUE(authority->ask({.name = name, .secret = secret}, [&](std::optional<Admitted> admitted) {
      said = std::move(admitted);
      answered = true;
    }));
    EXPECT_FALSE(answered) << "later";
    meanwhile();
    io.restart();
    while (!answered) io.run_one();
    return said;
  }

  const test::TemporaryDirectory directory;
  const std::string path = (directory.path() / "users").string();
  boost::asio::io_context io;
  std::unique_ptr<People> people;
  std::unique_ptr<PasswordAuthority> authority;
};

TEST_F(Authorities, AdmitWhoKnowsThePassword) {
  const auto anna = asked("anna", "correct horse");
  ASSERT_TRUE(anna);
  EXPECT_EQ(anna->person, (Person{.name = "anna", .role = "operator", .how = How::password}));
  EXPECT_TRUE(authority->stands(anna->person, anna->proof));
  EXPECT_FALSE(asked("anna", "wrong horse"));
  EXPECT_FALSE(asked("nobody", "correct horse"));
  EXPECT_FALSE(asked("panel-1", "")) << "a certificate knows no password";
}

TEST_F(Authorities, AdmitNobodyWhoIsOutMeanwhile) {
  EXPECT_FALSE(asked("anna", "correct horse", [&] {
    save("operator", "battery staple");
    EXPECT_TRUE(people->refresh());
  }));
}

TEST_F(Authorities, KnowWhoStandsNoLonger) {
  const auto anna = asked("anna", "correct horse");
  ASSERT_TRUE(anna);
  save("viewer", "correct horse");
  EXPECT_TRUE(people->refresh());
  EXPECT_FALSE(authority->stands(anna->person, anna->proof)) << "another role";
  const auto again = asked("anna", "correct horse");
  ASSERT_TRUE(again);
  ASSERT_TRUE(save_users(path, {}));
  EXPECT_TRUE(people->refresh());
  EXPECT_FALSE(authority->stands(again->person, again->proof)) << "nobody";
}

}  // namespace
}  // namespace axisd::web
