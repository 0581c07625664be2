#include "api/web/gateway/settings.hpp"

#include <gmock/gmock.h>

#include <string>

#include "api/transport/address.hpp"

namespace axisd::web {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;

std::string findings(std::string_view text) {
  std::string all;
  for (const auto& diagnostic : read_settings(text, "web.yaml").diagnostics)
    all += to_string(diagnostic) + '\n';
  return all;
}

TEST(Settings, HaveDefaultsForAComputerOfItsOwn) {
  const auto settings = read_settings("# nothing\nlisten: localhost:7480\n", "web.yaml").settings.value();
  EXPECT_EQ(settings.axisd.server, "localhost:7443");
  EXPECT_FALSE(settings.tls);
  EXPECT_EQ(settings.session_idle, 1h);
  EXPECT_FALSE(settings.users_named);
}

constexpr std::string_view several = R"(
axisd: { tls: { ca: d, certificate: e, key: f } }
machines: { press-1: one:7443, press-2: { server: two:7443, stop_server: two:7500 } }
)";

TEST(Settings, ReadSeveralMachines) {
  EXPECT_THAT(findings(several), IsEmpty());
  const auto machines = read_settings(several, "web.yaml").settings.value().machines;
  ASSERT_EQ(machines.size(), 2U);
  const auto& [first, second] = std::pair(machines.at("press-1"), machines.at("press-2"));
  EXPECT_EQ(first.server + first.stop_server + first.ca + first.certificate + first.key, "one:7443def");
  EXPECT_EQ(second.server + second.stop_server + second.ca, "two:7443two:7500d");
}

TEST(Settings, TellWhatIsWrongWithMachines) {
  const auto all = findings("axisd: { server: one:7443 }\nmachines: { Press: { servr: a }, b: {} }\n");
  for (const auto* text : {"'Press' is no name of a machine", "unknown key", "a machine needs 'server'",
                           "'machines' are several, and 'axisd.server' is one"})
    EXPECT_THAT(all, HasSubstr(text));
}

TEST(Settings, ReadEveryKey) {
  constexpr std::string_view text = R"(
listen: 0.0.0.0:443
tls: { certificate: a, key: b, client_ca: c }
axisd: { server: cell:7443, stop_server: cell:7500, tls: { ca: d, certificate: e, key: f } }
files: /g
users: /h
sessions: { idle: 5 min, longest: 6 min }
limits: { connections: 11, connections_each: 12, streams: 13, streams_each: 14, lanes: 15, lanes_each: 16, body: 17,
          log_in: 18 s, request: 19 s, idle: 20 s, stalled: 21 s }
)";
  EXPECT_THAT(findings(text), IsEmpty());
  const auto s = read_settings(text, "web.yaml").settings.value();
  EXPECT_EQ(s.listen + s.tls->certificate + s.tls->key + s.tls->client_ca, "0.0.0.0:443abc");
  EXPECT_EQ(s.axisd.server + s.axisd.stop_server + s.axisd.ca + s.axisd.certificate + s.axisd.key,
            "cell:7443cell:7500def");
  EXPECT_EQ(s.files + s.users, "/g/h");
  EXPECT_TRUE(s.users_named);
  EXPECT_EQ(s.session_idle + s.session_longest, 11min);
  EXPECT_THAT((std::vector{s.limits.connections, s.limits.connections_each, s.limits.streams,
                           s.limits.streams_each, s.limits.lanes, s.limits.lanes_each, s.limits.body}),
              testing::ElementsAre(11, 12, 13, 14, 15, 16, 17));
  EXPECT_THAT((std::vector{s.limits.log_in, s.limits.request, s.limits.idle, s.limits.stalled}),
              testing::ElementsAre(18s, 19s, 20s, 21s));
  for (const auto key : setting_keys())
    EXPECT_THAT(std::string(text) + std::string(several),
                HasSubstr(std::string(key.substr(key.rfind('.') + 1)) + ":"))
        << "not shown here";
}

TEST(Settings, TellEverythingThatIsWrongAtOnce) {
  const auto found = findings(R"(
listn: localhost:7480
files: [a]
sessions: { idle: 5, longest: 1 ms }
limits: { body: 1, lanes: many }
limits: {}
axisd: here
)");
  EXPECT_THAT(found, HasSubstr("web.yaml:2:1: unknown key 'listn'; did you mean 'listen'?"));
  EXPECT_THAT(found, HasSubstr("web.yaml:3:8: 'files' has to be a single value"));
  EXPECT_THAT(found, HasSubstr("web.yaml:4:19: 'sessions.idle'"));
  EXPECT_THAT(found, HasSubstr("'sessions.longest' cannot be '1 ms'; from 1 s to"));
  EXPECT_THAT(found, HasSubstr("'limits.body' cannot be '1'; a whole number from 16 to 4096"));
  EXPECT_THAT(found, HasSubstr("'limits.lanes' cannot be 'many'"));
  EXPECT_THAT(found, HasSubstr("web.yaml:6:1: 'limits' for the second time"));
  EXPECT_THAT(found, HasSubstr("web.yaml:7:8: this has to be a section"));
}

TEST(Settings, ServeOthersOnlyWithTls) {
  EXPECT_THAT(findings("listen: 0.0.0.0:7480"), HasSubstr("without TLS only this computer is served"));
  EXPECT_THAT(findings("listen: press-1:7480"), HasSubstr("without TLS only this computer is served"));
  EXPECT_THAT(findings("listen: 127.0.0.1:7480"), IsEmpty());
  EXPECT_THAT(findings("listen: '[::1]:7480'"), IsEmpty());
  EXPECT_THAT(findings("listen: 7480"), HasSubstr("write HOST:PORT"));
  EXPECT_THAT(findings("tls: { certificate: a }"), HasSubstr("'tls' needs 'certificate' and 'key'"));
  EXPECT_THAT(findings("axisd: { tls: { certificate: a, key: b } }"), HasSubstr("'axisd.tls' needs 'ca'"));
  EXPECT_THAT(findings("sessions: { idle: 20 min, longest: 10 min }"), HasSubstr("is longer than"));
}

TEST(Settings, FindTheStopLane) {
  EXPECT_EQ(transport::stop_lane_next_to("localhost:7443"), "localhost:7444");
  EXPECT_EQ(transport::stop_lane_next_to("[::1]:7443"), "[::1]:7444");
  EXPECT_EQ(transport::stop_lane_next_to("unix:/run/axisd.sock"), "unix:/run/axisd.sock.stop");
  EXPECT_EQ(transport::stop_lane_next_to("localhost:65535"), "");
  EXPECT_EQ(transport::stop_lane_next_to("localhost"), "");
}

}  // namespace
}  // namespace axisd::web
