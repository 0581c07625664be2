#include "api/cell/settings.hpp"

#include <gmock/gmock.h>

#include <string>

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string findings(std::string_view text) {
  std::string all;
  for (const auto& diagnostic : read_settings(text, "cell.yaml").diagnostics)
    all += to_string(diagnostic) + '\n';
  return all;
}

constexpr std::string_view whole = R"(
cell: hall-1
machine: press-1
listen: 0.0.0.0:7445
advertise: press-1.factory:7445
tls: { certificate: /c/crt, key: /c/key, client_ca: /c/ca, crl: /c/crl }
axisd:
  server: localhost:7443
  stop_server: localhost:7450
  advertise: press-1.factory:7443
  stop_advertise: press-1.factory:7450
  tls: { ca: /c/ca, certificate: /c/cell.crt, key: /c/cell.key }
etcd:
  endpoints: [ 10.0.0.1:2379, 10.0.0.2:2379 ]
  tls: { ca: /c/ca, certificate: /c/cell.crt, key: /c/cell.key }
  ttl: 20 s
peers:
  press-2: { axisd: press-2:7443, cell: press-2:7445 }
  press-3: { axisd: press-3:8000, stop: press-3:9000 }
roles: { anna: operator, shift-a: maintainer }
state: /var/lib/cell
metrics: { listen: 127.0.0.1:9465 }
limits: { calls: 1000, calls_each: 100 }
)";

TEST(CellSettings, ReadEveryKey) {
  EXPECT_EQ(findings(whole), "");
  const auto s = read_settings(whole, "cell.yaml").settings.value();
  EXPECT_EQ(s.cell, "hall-1");
  EXPECT_EQ(s.machine, "press-1");
  EXPECT_EQ(s.listen, "0.0.0.0:7445");
  EXPECT_EQ(s.advertise, "press-1.factory:7445");
  EXPECT_EQ(s.tls->certificate, "/c/crt");
  EXPECT_EQ(s.tls->crl, "/c/crl");
  EXPECT_EQ(s.axisd.server, "localhost:7443");
  EXPECT_EQ(s.axisd.stop_server, "localhost:7450");
  EXPECT_EQ(s.axisd.stop_advertise, "press-1.factory:7450");
  EXPECT_EQ(s.axisd.tls.certificate, "/c/cell.crt");
  EXPECT_THAT(s.etcd.endpoints, ElementsAre("10.0.0.1:2379", "10.0.0.2:2379"));
  EXPECT_EQ(s.etcd.tls.key, "/c/cell.key");
  EXPECT_EQ(s.etcd.ttl, 20s);
  EXPECT_EQ(s.peers.at("press-2").stop, "press-2:7444") << "next to axisd";
  EXPECT_EQ(s.peers.at("press-2").cell, "press-2:7445");
  EXPECT_EQ(s.peers.at("press-3").stop, "press-3:9000");
  EXPECT_EQ(role_of(s, "anna"), CellRole::operator_);
  EXPECT_EQ(role_of(s, "shift-a"), CellRole::maintainer);
  EXPECT_EQ(role_of(s, "somebody"), CellRole::viewer);
  EXPECT_EQ(s.state, "/var/lib/cell");
  EXPECT_EQ(s.metrics, "127.0.0.1:9465");
  EXPECT_EQ(s.calls, 1000);
  EXPECT_EQ(s.calls_each, 100);
  for (const auto key : setting_keys())
    EXPECT_THAT(std::string(whole), HasSubstr(key.substr(key.rfind('.') + 1)))
        << "the text above has every key";
}

TEST(CellSettings, HaveDefaultsForOneComputer) {
  const auto s = read_settings("cell: a\nmachine: b\n", "cell.yaml").settings.value();
  EXPECT_EQ(s.listen, "localhost:7445");
  EXPECT_EQ(s.advertise, "localhost:7445");
  EXPECT_EQ(s.axisd.stop_server, "localhost:7444");
  EXPECT_TRUE(s.etcd.endpoints.empty());
  EXPECT_FALSE(s.tls);
}

TEST(CellSettings, TellAllErrorsAtOnceWithTheirPlaces) {
  constexpr std::string_view text = R"(cell: Hall
mashine: press-1
axisd: { advertise: press-1:7443 }
etcd: { endpoints: [ nowhere ], ttl: 1 s }
)";
  EXPECT_EQ(findings(text),
            "cell.yaml:1:1: 'machine' is missing; write machine: a-name\n"
            "cell.yaml:1:7: 'cell' cannot be 'Hall'; a letter, then letters, digits, - or _; lower case; at "
            "most 64\n"
            "cell.yaml:2:1: unknown key 'mashine'; did you mean 'machine'?\n"
            "cell.yaml:4:7: 'etcd.endpoints' cannot have 'nowhere'; write HOST:2379\n"
            "cell.yaml:4:38: 'etcd.ttl' cannot be '1 s'; from 5 s to 300 s\n");
}

TEST(CellSettings, ServeOthersWithCertificatesOnly) {
  constexpr std::string_view names = "cell: a\nmachine: b\n";
  EXPECT_THAT(findings(std::string(names) + "listen: 0.0.0.0:7445\n"),
              HasSubstr("without TLS only this computer"));
  EXPECT_THAT(findings(std::string(names) + "tls: { certificate: /a, key: /b }\n"), HasSubstr("client_ca"));
}

TEST(CellSettings, NeedToSayWhereOthersReachAMachineOfARegistry) {
  EXPECT_THAT(findings("cell: a\nmachine: b\netcd: { endpoints: [ localhost:2379 ] }\n"),
              HasSubstr("'axisd.advertise' is missing"));
}

TEST(CellSettings, RefusePeersThatCannotBe) {
  constexpr std::string_view names = "cell: a\nmachine: b\npeers:\n";
  const auto with = [&](std::string_view peer) { return findings(std::string(names) + std::string(peer)); };
  EXPECT_THAT(with("  B: { axisd: x:1 }\n"), HasSubstr("'B' is no name of a machine"));
  EXPECT_THAT(with("  c: { stop: x:1 }\n"), HasSubstr("needs 'axisd'"));
  EXPECT_THAT(with("  c: { axisd: x }\n"), HasSubstr("'axisd' cannot be 'x'"));
  EXPECT_THAT(with("  c: { axisd: x:1, axis: y:1 }\n"), HasSubstr("unknown key 'axis'"));
  EXPECT_THAT(with("  b: { axisd: x:1 }\n"), HasSubstr("this machine itself"));
  EXPECT_THAT(with("  c: { axisd: x:1 }\n  c: { axisd: x:1 }\n"), HasSubstr("for the second time"));
}

TEST(CellSettings, RefuseOtherNonsense) {
  constexpr std::string_view names = "cell: a\nmachine: b\n";
  const auto with = [&](std::string_view more) { return findings(std::string(names) + std::string(more)); };
  EXPECT_THAT(with("roles: { anna: boss }\n"), HasSubstr("'boss' is no role"));
  EXPECT_THAT(with("axisd: { tls: { certificate: /a } }\n"), HasSubstr("belong together"));
  EXPECT_THAT(with("axisd: { tls: { certificate: /a, key: /b } }\n"), HasSubstr("needs 'ca'"));
  EXPECT_THAT(with("axisd: { server: nowhere }\n"), HasSubstr("'axisd.server' cannot be"));
  EXPECT_THAT(with("etcd: { ttl: 5500 ms }\n"), HasSubstr("whole seconds"));
  EXPECT_THAT(with("state: here\n"), HasSubstr("absolute path"));
  EXPECT_THAT(with("limits: { calls: 20, calls_each: 30 }\n"), HasSubstr("more than"));
  EXPECT_THAT(with("listen: x\n"), HasSubstr("write HOST:PORT"));
  EXPECT_THAT(findings("- a\n"), HasSubstr("no section"));
}

}  // namespace
}  // namespace axisd::cell
