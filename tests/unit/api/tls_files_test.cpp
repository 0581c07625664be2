// What is wrong with the files of `server.tls`, when they end, and whether they were replaced.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "api/tls/client_check.hpp"
#include "api/tls/clients.hpp"
#include "api/tls/expiry.hpp"
#include "api/tls/file_watch.hpp"
#include "api/tls/live.hpp"
#include "api/tls/pem_files.hpp"
#include "buses/file_descriptor.hpp"
#include "tests/unit/api/certificates.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class TlsFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    certificates_.make_ca("ca");
    certificates_.make_pair("server", "ca");
    files_ = certificates_.server_files();
  }
  /// The only finding: at which key, and its text.
  void finds(const std::string& key, const std::string& file, const std::string& what, WallTime now) const {
    const auto found = tls::check(files_, now);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].first, key);
    EXPECT_THAT(found[0].second.message, StartsWith(directory_ / file + ": " + what));
    EXPECT_FALSE(found[0].second.remedy.empty());
    EXPECT_FALSE(tls::read(files_, now));
  }
  void finds(const std::string& key, const std::string& file, const std::string& what) const {
    finds(key, file, what, std::chrono::system_clock::now());
  }

  TemporaryDirectory directory_;
  Certificates certificates_{directory_};
  tls::Files files_;
};

TEST_F(TlsFiles, GoodOnesAreRead) {
  EXPECT_THAT(tls::check(files_), IsEmpty());
  const auto contents = tls::read(files_);
  ASSERT_TRUE(contents);
  EXPECT_EQ(contents->certificate, certificates_.read("server.crt"));
  EXPECT_EQ(contents->crl, "");
  certificates_.revoke("ca", {"server"});
  files_.crl = directory_ / "ca.crl";
  EXPECT_EQ(tls::read(files_)->crl, certificates_.read("ca.crl"));
}

TEST_F(TlsFiles, ThatCannotBeUsedAreNamed) {
  certificates_.make_pair("other", "ca");
  std::ofstream(directory_ / "garbage")
      << "-----BEGIN CERTIFICATE-----\nnonsense\n-----END CERTIFICATE-----\n";
  const auto good = files_;
  files_.key = directory_ / "other.key";
  finds("key", "other.key", "the key does not belong to the certificate " + good.certificate);
  files_ = good;
  files_.key = directory_ / "missing";
  finds("key", "missing", "cannot read: No such file");
  files_.key = directory_ / "garbage";
  finds("key", "garbage", "no usable private key in PEM format");
  files_ = good;
  files_.certificate = directory_ / "garbage";
  finds("certificate", "garbage", "certificate 1 is not readable");
  files_ = good;
  files_.client_ca = directory_ / "server.key";
  finds("client_ca", "server.key", "no certificate in PEM format");
}

TEST_F(TlsFiles, AKeyIsForItsOwnerAndGroup) {
  namespace fs = std::filesystem;
  fs::permissions(files_.key, fs::perms::owner_read | fs::perms::group_read);
  EXPECT_THAT(tls::check(files_), IsEmpty());
  fs::permissions(files_.key, fs::perms::others_read, fs::perm_options::add);
  finds("key", "server.key", "every user of this computer may read or change this private key (mode 0444)");
  EXPECT_EQ(tls::check(files_)[0].second.remedy, "chmod 640 " + files_.key);
}

TEST_F(TlsFiles, HaveToBeValid) {
  const auto now = std::chrono::system_clock::now();
  finds("certificate", "server.crt", "the certificate has expired (2", now + 72h);
  const auto later = tls::check(files_, now + std::chrono::days(31));
  ASSERT_EQ(later.size(), 2U);
  EXPECT_THAT(later[0].second.message, MatchesRegex(".*/server.crt: the certificate has expired .*Z\\)"));
  EXPECT_THAT(later[1].second.message, HasSubstr("/ca.crt: the certificate has expired"));
  const auto earlier = tls::check(files_, now - 24h);
  ASSERT_EQ(earlier.size(), 2U);
  EXPECT_THAT(earlier[0].second.message, MatchesRegex(".*: the certificate is not valid before .*Z"));
  EXPECT_THAT(earlier[0].second.remedy, MatchesRegex("this computer's clock says .*Z: set it, or .*"));
  EXPECT_EQ(tls::check(files_, now - 23h)[0].second.message, earlier[0].second.message) << "of another time";
  for (const auto& found : {later[0], later[1], earlier[0], earlier[1]})
    EXPECT_EQ(found.second.reason, Reason::configuring) << "to be tried again";
  for (const auto wrong_clock : {now + std::chrono::days(31), now - 24h}) {
    EXPECT_EQ(tls::check(files_, wrong_clock, tls::Demand::usable).size(), 2U);
    EXPECT_THAT(tls::check(files_, wrong_clock, tls::Demand::usable_some_time), IsEmpty());
  }
}

TEST_F(TlsFiles, RevocationListsAreOfTheAuthorityAndNew) {
  certificates_.make_ca("second");
  certificates_.revoke("ca", {});
  certificates_.revoke("second", {});
  files_.crl = directory_ / "second.crl";
  finds("crl", "second.crl", "the CRL was not issued by an authority of " + files_.client_ca);
  files_.crl = directory_ / "ca.crt";
  finds("crl", "ca.crt", "no CRL in PEM format");
  files_.crl = directory_ / "ca.crl";
  const auto later = tls::check(files_, std::chrono::system_clock::now() + 72h);
  ASSERT_EQ(later.size(), 2U);
  EXPECT_THAT(later[1].second.message, HasSubstr("/ca.crl: the CRL has expired ("));
  std::ofstream(files_.client_ca, std::ios::app) << certificates_.read("ca.crl");
  files_.crl = "";
  finds("client_ca", "ca.crt", "holds a CRL, which nobody looks at here");
}

/// That nobody has written a new list must not keep a daemon from starting, nor from a new pair.
TEST_F(TlsFiles, ARevocationListThatIsOutOfDateIsServed) {
  const auto now = std::chrono::system_clock::now();
  certificates_.make_pair("old", "ca");
  files_.crl = directory_ / "ca.crl";
  for (const auto* times : {"-crl_lastupdate 20200101000000Z -crl_nextupdate 20210101000000Z",
                            "-crl_lastupdate 20900101000000Z -crl_nextupdate 20910101000000Z"}) {
    certificates_.revoke("ca", {}, times);
    const auto found = tls::check(files_, now);
    ASSERT_EQ(found.size(), 1U) << times;
    EXPECT_THAT(found[0].second.message, StartsWith(files_.crl + ": the CRL ")) << times;
    EXPECT_THAT(tls::check(files_, now, tls::Demand::usable), IsEmpty()) << times;
  }
  certificates_.revoke("ca", {"old"}, "-crl_lastupdate 20200101000000Z -crl_nextupdate 20210101000000Z");
  const auto live = tls::Live::open(files_);
  ASSERT_TRUE(live) << to_string(live.error());
  certificates_.make_pair("server", "ca");
  EXPECT_TRUE((*live)->reload().value_or(false));
  EXPECT_EQ((*live)->served()->contents.certificate, certificates_.read("server.crt"));
  EXPECT_TRUE((*live)->served()->clients.of(certificates_.read("old.crt"), now + 1h).refusal);
}

TEST_F(TlsFiles, ClientsAreJudgedAtEachTime) {
  certificates_.make_pair("hmi", "ca");
  certificates_.make_pair("old", "ca");
  certificates_.revoke("ca", {"old"});
  files_.crl = directory_ / "ca.crl";
  const tls::Clients clients(*tls::read(files_));
  const auto soon = std::chrono::system_clock::now() + 1h;
  const auto refusal = [&](const std::string& name, WallTime now) {
    const auto client = clients.of(certificates_.read(name + ".crt"), now);
    EXPECT_EQ(client.name, name);
    if (client.refusal) {
      EXPECT_EQ(client.refusal->reason, Reason::unauthenticated);
    }
    return client.refusal ? client.refusal->message : "";
  };
  EXPECT_EQ(refusal("hmi", soon), "");
  EXPECT_THAT(refusal("old", soon), MatchesRegex("the certificate of old was revoked .*Z\\)"));
  EXPECT_THAT(refusal("hmi", soon + 72h), StartsWith("the certificate of hmi has expired ("));
  EXPECT_THAT(refusal("hmi", soon + std::chrono::days(31)),
              StartsWith("the certificate of hmi is of an authority whose own has expired ("));
  EXPECT_EQ(refusal("hmi", soon - 72h), "") << "it was valid when it connected";
  EXPECT_EQ(refusal("hmi", soon), "") << "the clock was put right";
  EXPECT_THAT(refusal("old", soon - 72h), HasSubstr("was revoked"));
  EXPECT_THAT(refusal("old", soon + 36h), HasSubstr("was revoked")) << "the list is out of date by then";
  certificates_.make_ca("second");
  certificates_.make_pair("stranger", "second");
  const auto stranger = clients.of(certificates_.read("stranger.crt"), soon);
  ASSERT_TRUE(stranger.refusal);
  EXPECT_THAT(stranger.refusal->message, HasSubstr("is not of an authority that the daemon trusts"));
  EXPECT_TRUE(clients.of("nonsense", soon).refusal);
}

/// Whoever has never been asked about before the clock was set back is judged likewise.
TEST_F(TlsFiles, AClockThatStepsBackTakesNothingAway) {
  certificates_.make_pair("hmi", "ca");
  const tls::Clients clients(*tls::read(files_));
  const auto now = std::chrono::system_clock::now();
  EXPECT_FALSE(clients.of(certificates_.read("hmi.crt"), WallTime{}).refusal);
  EXPECT_FALSE(clients.of(certificates_.read("hmi.crt"), now + 1h).refusal);
  EXPECT_TRUE(clients.of(certificates_.read("hmi.crt"), now + 72h).refusal);
  EXPECT_FALSE(clients.of(certificates_.read("hmi.crt"), now - 72h).refusal);
  certificates_.make_ca("second");
  certificates_.make_pair("stranger", "second");
  EXPECT_TRUE(clients.of(certificates_.read("stranger.crt"), now - 72h).refusal);
}

TEST_F(TlsFiles, ManyCertificatesWithOneChangeNothing) {
  certificates_.make_pair("hmi", "ca");
  const tls::Clients clients(*tls::read(files_));
  const auto soon = std::chrono::system_clock::now() + 1h;
  auto pem = certificates_.read("hmi.crt");
  while (pem.size() < 32'768) pem += certificates_.read("server.crt");
  for (int i = 0; i < 2; ++i) {
    const auto client = clients.of(pem, soon);
    EXPECT_EQ(client.name, "hmi");
    EXPECT_FALSE(client.refusal);
  }
}

/// What a client is told where gRPC says that it could not connect.
TEST_F(TlsFiles, ClientsAreToldWhatIsWrong) {
  certificates_.make_ca("second");
  certificates_.make_pair("hmi", "ca");
  certificates_.make_pair("stranger", "second");
  const auto now = std::chrono::system_clock::now() + 1h;
  const auto files = [&](const std::string& ca, const std::string& name) {
    return tls::ClientFiles{.ca = certificates_.read(ca + ".crt"),
                            .certificate = name.empty() ? "" : certificates_.read(name + ".crt"),
                            .key = name.empty() ? "" : certificates_.read(name + ".key")};
  };
  const auto text = [](const std::optional<Error>& error) { return error ? error->message : ""; };
  EXPECT_EQ(text(tls::wrong_with(files("ca", "hmi"), now)), "");
  auto mixed = files("ca", "hmi");
  mixed.key = certificates_.read("stranger.key");
  EXPECT_EQ(text(tls::wrong_with(mixed, now)),
            "--tls-key: the key does not belong to the certificate of --tls-cert");
  EXPECT_THAT(text(tls::wrong_with(files("ca", "hmi"), now + 72h)),
              StartsWith("--tls-cert: the certificate has expired ("));

  const tls::Shown shown{
      .certificates = certificates_.read("server.crt"), .asks = true, .accepted = {"CN=ca", "CN=other"}};
  const auto refused = [&](const tls::ClientFiles& own, const std::string& host, WallTime at) {
    return text(tls::why_refused(own, shown, host, at));
  };
  EXPECT_EQ(refused(files("ca", "hmi"), "localhost", now), "");
  EXPECT_EQ(refused(files("ca", "hmi"), "127.0.0.1", now), "");
  EXPECT_EQ(refused(files("ca", "hmi"), "10.0.0.5", now),
            "the daemon's certificate is for localhost, 127.0.0.1, you called 10.0.0.5");
  EXPECT_EQ(refused(files("second", "hmi"), "localhost", now),
            "the daemon's certificate is signed by CN=ca, which is not in --tls-ca");
  EXPECT_THAT(refused(files("ca", "hmi"), "localhost", now + 72h),
              StartsWith("the daemon's certificate has expired ("));
  EXPECT_THAT(refused(files("ca", "hmi"), "localhost", now + std::chrono::days(31)),
              StartsWith("the authority that signed the daemon's certificate has expired ("));
  EXPECT_EQ(refused(files("ca", ""), "localhost", now), "the daemon asks for a certificate of the client");
  EXPECT_EQ(refused(files("ca", "stranger"), "localhost", now),
            "the daemon does not take certificates of CN=second, which signed that of --tls-cert");
  EXPECT_EQ(text(tls::why_refused({}, shown, "localhost", now)), "the daemon speaks TLS");
  EXPECT_EQ(text(tls::why_refused(files("ca", "hmi"), {}, "localhost", now)),
            "the daemon speaks no TLS at that address");
}

TEST_F(TlsFiles, AServerShowsWhatItHas) {
  FakeMachine machine;
  server::Server server(machine, {.listen = {"127.0.0.1:0"}, .tls = certificates_.served()});
  const auto port = server.start();
  ASSERT_TRUE(port) << to_string(port.error());
  const auto shown = tls::look_at("127.0.0.1", std::to_string(*port), patience);
  ASSERT_TRUE(shown);
  EXPECT_EQ(tls::first_expiry(shown->certificates), tls::first_expiry(certificates_.read("server.crt")));
  EXPECT_TRUE(shown->asks);
  EXPECT_THAT(shown->accepted, ElementsAre("CN=ca"));
  server.shutdown();
  EXPECT_FALSE(tls::look_at("127.0.0.1", std::to_string(*port), patience));
}

TEST_F(TlsFiles, AServerWithoutShowsNothing) {
  FakeMachine machine;
  server::Server server(machine, {.listen = {"127.0.0.1:0"}});
  const auto port = server.start();
  ASSERT_TRUE(port) << to_string(port.error());
  const auto shown = tls::look_at("127.0.0.1", std::to_string(*port), patience);
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->certificates, "");
}

/// It says something that is answered with an alert, and is gone: a write to it raises SIGPIPE.
void leave_in_the_handshake(int listener) {
  const FileDescriptor client(accept4(listener, nullptr, nullptr, SOCK_CLOEXEC));
  pollfd hello{.fd = client.get(), .events = POLLIN, .revents = 0};
  if (poll(&hello, 1, -1) != 1) return;
  constexpr std::string_view nonsense("\x16\x03\x03\0\x04\x02\0\0\0", 9);
  send(client.get(), nonsense.data(), nonsense.size(), MSG_NOSIGNAL | MSG_MORE);
  shutdown(client.get(), SHUT_WR);
}  // the hello was not read: that is told with a reset

TEST(TlsLook, AtOneThatLeavesEndsNothing) {
  const FileDescriptor listener(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(listener.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(listener.get(), 8), 0);
  ASSERT_EQ(getsockname(listener.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  // As axisctl has it, whatever a library of this program has made of it.
  struct sigaction usual{}, before{};
  usual.sa_handler = SIG_DFL;
  ASSERT_EQ(sigaction(SIGPIPE, &usual, &before), 0);
  for (int i = 0; i < 8; ++i) {
    std::thread leaving(leave_in_the_handshake, listener.get());
    EXPECT_FALSE(tls::look_at("127.0.0.1", std::to_string(ntohs(address.sin_port)), patience));
    leaving.join();
  }
  sigset_t blocked, pending;
  pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
  sigpending(&pending);
  EXPECT_EQ(sigismember(&blocked, SIGPIPE), 0);
  EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
  sigaction(SIGPIPE, &before, nullptr);
}

TEST_F(TlsFiles, EndIsToldThirtyDaysAheadAndEveryDay) {
  const auto now = std::chrono::system_clock::now();
  const auto all = tls::expiries(files_, *tls::read(files_), now);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].path, files_.certificate);
  EXPECT_EQ(all[0].key, "certificate");
  EXPECT_EQ(all[1].key, "client_ca");
  EXPECT_GT(all[0].at, now + 47h);
  EXPECT_LE(all[0].at, now + 49h);
  EXPECT_EQ(all[0].at, tls::first_expiry(certificates_.read("server.crt")));

  tls::Reminder reminder;
  const WallTime end(1'800'000'000s);
  const std::vector<tls::Expiry> one{{.path = "/a.crt", .what = "the certificate", .at = end}};
  TimePoint clock{};
  const auto said = [&](WallTime wall) {
    std::vector<std::string> texts;
    for (const auto& notice : reminder.due(one, wall, clock)) texts.push_back(notice.text);
    return texts;
  };
  EXPECT_THAT(said(end - std::chrono::days(31)), IsEmpty());
  EXPECT_THAT(
      said(end - std::chrono::days(20)),
      ElementsAre(StartsWith("/a.crt: the certificate expires in 20 days (2027-01-15T08:00:00Z); renew")));
  EXPECT_THAT(said(end - std::chrono::days(20)), IsEmpty());
  clock += 24h;
  EXPECT_THAT(said(end - std::chrono::days(1)), ElementsAre(HasSubstr("in 1 day (")));
  EXPECT_THAT(said(end + 1s), ElementsAre(HasSubstr("the certificate has expired (")));
  EXPECT_THAT(said(end + 2s), IsEmpty());
  clock += 24h;
  EXPECT_THAT(said(end + 3s), ElementsAre(HasSubstr("has expired")));
}

/// An authority may have signed the daemon's certificate and those of its clients: one file for two keys.
TEST(TlsReminder, TellsOfOneFileUnderEachKey) {
  const WallTime end(1'800'000'000s);
  const std::vector<tls::Expiry> all{
      {.path = "/a.crt", .what = "the certificate", .at = end},
      {.path = "/a.crt", .what = "an authority of the clients", .at = end + 24h}};
  tls::Reminder reminder;
  TimePoint clock{};
  EXPECT_EQ(reminder.due(all, end - 48h, clock).size(), 2U);
  EXPECT_THAT(reminder.due(all, end - 48h, clock + 1min), IsEmpty()) << "both were told";
  EXPECT_EQ(reminder.due(all, end - 24h, clock + 24h).size(), 2U);
}

TEST_F(TlsFiles, AreWatchedUntilTheyRest) {
  tls::FileWatch watch({files_.certificate, files_.key});
  EXPECT_FALSE(watch.settled());
  EXPECT_TRUE(watch.settled()) << "whatever was read before";
  EXPECT_FALSE(watch.settled());
  std::ofstream(files_.certificate, std::ios::app) << "\n";
  EXPECT_FALSE(watch.settled()) << "its key may be on its way";
  std::filesystem::rename(files_.key, directory_ / "away");
  EXPECT_FALSE(watch.settled());
  EXPECT_TRUE(watch.settled());
  EXPECT_FALSE(watch.settled());
  std::filesystem::rename(directory_ / "away", files_.key);
  EXPECT_FALSE(watch.settled());
  EXPECT_TRUE(watch.settled());
}

}  // namespace
}  // namespace axisd::testing
