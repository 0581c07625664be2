// No two clients have one name.
#include "api/tls/identity.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "api/server/user_names.hpp"
#include "tests/unit/api/certificates.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::MatchesRegex;

class Identity : public ::testing::Test {
 protected:
  void SetUp() override {
    certificates_.make_ca("ca");
    certificates_.make_ca("second");
  }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream file(directory_ / (name + ".crt"));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string named(const std::string& file, const std::string& subject, const std::string& extensions = "",
                    const std::string& ca = "ca") {
    certificates_.make_pair(file, ca, subject, extensions);
    return tls::Identities(read("ca") + read("second")).of(read(file));
  }
  TemporaryDirectory directory_;
  Certificates certificates_{directory_};
};

TEST_F(Identity, IsTheCommonNameElseTheFirstAlternative) {
  EXPECT_EQ(named("one", "/CN=operator"), "operator");
  EXPECT_EQ(named("two", "/O=press", "subjectAltName=URI:spiffe://cell/press\n"), "spiffe://cell/press");
  EXPECT_THAT(named("three", "/O=press"), MatchesRegex("unnamed:[0-9a-f]{16}"));
}

TEST_F(Identity, OfASecondAuthorityIsAnother) {
  EXPECT_EQ(named("one", "/CN=operator"), "operator");
  EXPECT_THAT(named("two", "/CN=operator", "", "second"), MatchesRegex("operator~[0-9a-f]{16}"));
}

/// A name is made up quickly, a key is not.
TEST_F(Identity, OfAnotherAuthorityOfTheSameNameIsAnother) {
  certificates_.make_ca("twin", "/CN=ca");
  certificates_.make_pair("own", "ca", "/CN=operator", "");
  certificates_.make_pair("twins", "twin", "/CN=operator", "");
  const tls::Identities both(read("ca") + read("twin")), first(read("ca") + read("second"));
  EXPECT_EQ(both.of(read("own")), "operator");
  EXPECT_THAT(both.of(read("twins")), MatchesRegex("operator~[0-9a-f]{16}"));
  // Nor by way of an authority in between that has the name of the first.
  certificates_.make_pair("between", "second", "/CN=ca", "basicConstraints=critical,CA:TRUE\n");
  certificates_.make_pair("below", "between", "/CN=operator", "");
  const auto below = first.of(read("below") + read("between"));
  EXPECT_THAT(below, MatchesRegex("operator~[0-9a-f]{16}"));
  EXPECT_NE(below, both.of(read("twins")));
}

/// What a client sends beside its certificate does not make it another one.
TEST_F(Identity, IsTheSameWithTheCertificatesThatCameWithIt) {
  certificates_.make_pair("one", "second", "/CN=operator", "");
  certificates_.make_pair("two", "ca", "/O=press", "");
  const tls::Identities identities(read("ca") + read("second"));
  for (const auto* file : {"one", "two"})
    EXPECT_EQ(identities.of(read(file)), identities.of(read(file) + read("second"))) << file;
}

TEST_F(Identity, TellsLettersApartThatItCannotShow) {
  const auto one = named("one", "/CN=J\xC3\xBCrg"), two = named("two", "/CN=J\xC3\xB6rg");
  EXPECT_THAT(one, MatchesRegex("J[?]+rg~[0-9a-f]{16}"));
  EXPECT_THAT(two, MatchesRegex("J[?]+rg~[0-9a-f]{16}"));
  EXPECT_NE(one, two);
}

TEST_F(Identity, TellsLongNamesApart) {
  const auto uri = "subjectAltName=URI:https://press/" + std::string(130, 'a');
  const auto one = named("one", "/O=press", uri + "1\n"), two = named("two", "/O=press", uri + "2\n");
  EXPECT_NE(one, two);
  EXPECT_LE(one.size(), 128U);
}

TEST_F(Identity, LooksLikeNobodyElses) {
  EXPECT_THAT(named("one", "/CN=local:localhost"), MatchesRegex("local:localhost~[0-9a-f]{16}"));
  EXPECT_THAT(named("two", "/CN=unix:root"), MatchesRegex("unix:root~[0-9a-f]{16}"));
  EXPECT_THAT(named("three", "'/CN=shift-a via web'"), MatchesRegex("shift-a[?]via[?]web~[0-9a-f]{16}"));
}

TEST(LocalPeer, IsTheUserAndTheProgram) {
  const auto peer = server::local_peer(transport::connected_pair().first.get());
  EXPECT_THAT(peer.name, MatchesRegex("unix:[A-Za-z0-9._+-]+"));
  EXPECT_THAT(peer.program, MatchesRegex("[A-Za-z0-9._+-]+"));
}

TEST(UserNames, AreLookedUpOnceInAWhile) {
  std::vector<uid_t> looked_up;
  server::UserNames names([&looked_up](uid_t user) {
    looked_up.push_back(user);
    return std::to_string(looked_up.size());
  });
  const auto begin = TimePoint{} + std::chrono::hours(1);
  EXPECT_EQ(names.of(1000, begin), "1");
  EXPECT_EQ(names.of(1000, begin + server::UserNames::longest - Duration(1)), "1");
  EXPECT_EQ(names.of(1001, begin), "2");
  EXPECT_EQ(names.of(1000, begin + server::UserNames::longest), "3");
  EXPECT_THAT(looked_up, ::testing::ElementsAre(1000, 1001, 1000));
}

TEST(UserNames, OfTooManyTheOldestIsForgotten) {
  std::size_t looked_up = 0;
  server::UserNames names([&looked_up](uid_t user) {
    ++looked_up;
    return std::to_string(user);
  });
  const auto begin = TimePoint{} + std::chrono::hours(1);
  for (uid_t user = 0; user <= server::UserNames::most; ++user)
    (void)names.of(user, begin + std::chrono::microseconds(user));
  const auto end = begin + std::chrono::seconds(1);
  EXPECT_EQ(names.of(1, end), "1");
  EXPECT_EQ(looked_up, server::UserNames::most + 1);
  EXPECT_EQ(names.of(0, end), "0");
  EXPECT_EQ(looked_up, server::UserNames::most + 2);
}

}  // namespace
}  // namespace axisd::testing
