// What is told of the files of `server.tls`, and how often, by times that the test makes.
#include "daemon/certificate_keeper.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/api/certificates.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using What = CertificateNotice::What;

class KeptCertificates : public ::testing::Test {
 protected:
  void SetUp() override {
    certificates_.make_ca("ca");
    certificates_.make_pair("server", "ca");
    live_ = certificates_.served();
    keeper_ = std::make_unique<CertificateKeeper>(
        live_, [this](CertificateNotice notice) { told_.push_back(std::move(notice)); });
    EXPECT_THAT(texts_after(0s), IsEmpty());
    EXPECT_THAT(texts_after(1s), IsEmpty()) << "they are what is served";
  }
  /// What the next look tells of replaced files, so much later: the clock on the wall goes along.
  std::vector<std::string> texts_after(std::chrono::seconds time) {
    now_ += time;
    wall_ += time;
    told_.clear();
    keeper_->look(wall_, now_);
    std::vector<std::string> texts;
    for (const auto& notice : told_)
      if (notice.what == What::replaced || notice.what == What::not_replaced) texts.push_back(notice.text);
    return texts;
  }

  TemporaryDirectory directory_;
  Certificates certificates_{directory_};
  std::shared_ptr<tls::Live> live_;
  std::vector<CertificateNotice> told_;
  std::unique_ptr<CertificateKeeper> keeper_;
  WallTime wall_ = std::chrono::system_clock::now() + 1h;
  TimePoint now_ = TimePoint{} + 1h;
};

TEST_F(KeptCertificates, AreServedOnceTheFilesRest) {
  certificates_.make_pair("server", "ca");
  EXPECT_THAT(texts_after(1s), IsEmpty());
  EXPECT_THAT(texts_after(1s), ElementsAre(HasSubstr("the files were replaced")));
  EXPECT_EQ(live_->served()->contents.certificate, certificates_.read("server.crt"));
  EXPECT_THAT(texts_after(1s), IsEmpty());
}

/// A text with the time in it would be another one each minute.
TEST_F(KeptCertificates, ThatAreNotValidYetAreComplainedOfOnceAndTriedEachMinute) {
  const auto right = wall_;
  certificates_.make_pair("server", "ca");
  wall_ -= 24h;
  EXPECT_THAT(texts_after(1s), IsEmpty());
  EXPECT_THAT(texts_after(1s), ElementsAre(HasSubstr("/server.crt: the certificate is not valid before ")));
  EXPECT_EQ(told_.back().what, What::not_replaced);
  for (int minute = 0; minute < 3; ++minute) EXPECT_THAT(texts_after(60s), IsEmpty());
  wall_ = right;
  EXPECT_THAT(texts_after(59s), IsEmpty()) << "it was tried 59 s ago";
  EXPECT_THAT(texts_after(1s), ElementsAre(HasSubstr("the files were replaced")));
  EXPECT_EQ(live_->served()->contents.certificate, certificates_.read("server.crt"));
}

TEST_F(KeptCertificates, ThatAreOfNoUseForAnotherReasonAreComplainedOfAgain) {
  std::ofstream(directory_ / "server.crt") << "nonsense";
  EXPECT_THAT(texts_after(1s), IsEmpty());
  EXPECT_THAT(texts_after(1s), ElementsAre(HasSubstr("server.crt: no certificate in PEM format")));
  certificates_.make_pair("other", "ca");
  std::ofstream(directory_ / "server.crt") << certificates_.read("other.crt");
  EXPECT_THAT(texts_after(1s), IsEmpty());
  EXPECT_THAT(texts_after(1s), ElementsAre(HasSubstr("the key does not belong to the certificate")));
  EXPECT_THAT(texts_after(60s), IsEmpty());
}

TEST_F(KeptCertificates, AreReadAtOnceWhenThatIsAskedFor) {
  certificates_.make_pair("server", "ca");
  keeper_->reload(wall_, now_);
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].what, What::replaced);
  EXPECT_EQ(told_[0].expires, tls::first_expiry(certificates_.read("server.crt")));
  EXPECT_THAT(texts_after(1s), IsEmpty());
  EXPECT_THAT(texts_after(1s), IsEmpty()) << "they are what is served";
}

TEST_F(KeptCertificates, WithARevocationListThatIsOutOfDateAreServedAndToldOfEachDay) {
  auto files = certificates_.server_files();
  files.crl = directory_ / "ca.crl";
  certificates_.revoke("ca", {}, "-crl_lastupdate 20200101000000Z -crl_nextupdate 20210101000000Z");
  const auto live = Certificates::served(files);
  std::vector<std::string> expired;
  CertificateKeeper keeper(live, [&](const CertificateNotice& notice) {
    if (notice.what == What::expired) expired.push_back(notice.text);
  });
  const auto look = [&](std::chrono::seconds time) {
    now_ += time;
    wall_ += time;
    keeper.look(wall_, now_);
  };
  look(0s);
  EXPECT_THAT(expired,
              ElementsAre(HasSubstr("/ca.crl: the CRL has expired (2021-01-01T00:00:00Z); renew it")));
  look(1s);
  certificates_.make_pair("server", "ca");
  look(60s);
  look(1s);
  EXPECT_EQ(live->served()->contents.certificate, certificates_.read("server.crt"));
  EXPECT_EQ(expired.size(), 1U);
  look(24h);
  EXPECT_EQ(expired.size(), 2U);
}

}  // namespace
}  // namespace axisd::testing
