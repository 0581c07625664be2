// A configuration that a client sends: which of the files that it names are read.
#include "config/clients_text.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/temporary_directory.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string text_of(const std::string& sheet, const std::string& server = "") {
  return fmt::format(R"(machine: press-1
{}buses: {{ can0: {{ canopen: {{ interface: sim }} }} }}
axes:
  feeder:
    bus: can0
    node: 1
    model: cia402
    unit: mm
    scale: {{ microstep: 65536 pulses/rev, travel: 5 mm/rev }}
    limits: {{ position: [0, 300], velocity: 100 mm/s }}
    inputs: {{ NEG: negative_limit, POS: positive_limit, HOME: home }}
    drive: {{ eds: {}, velocity_unit: pulses_per_second }}
)",
                     server, sheet);
}

class ClientsText : public ::testing::Test {
 protected:
  ClientsText() {
    std::filesystem::create_directories(own() / "sheets");
    sheet_ = read_text(source_path("config/examples/standard-drive.eds"));
    directory_.write("etc/sheets/drive.eds", sheet_);
    directory_.write("elsewhere.eds", sheet_);
    directory_.write("etc2.eds", sheet_);
  }
  [[nodiscard]] std::filesystem::path own() const { return directory_ / "etc"; }
  [[nodiscard]] std::string found(const std::string& text, const std::set<std::string>& others = {}) const {
    return findings(load_clients_text(text, (own() / "axisd.yaml").string(), others, {}, Duration::max()));
  }

  test::TemporaryDirectory directory_;
  std::string sheet_;
};

TEST_F(ClientsText, FilesBelowTheFolderAreRead) {
  EXPECT_EQ(found(text_of("sheets/drive.eds")), "");
  EXPECT_EQ(found(text_of((own() / "sheets/drive.eds").string())), "");
  EXPECT_EQ(found(text_of("sheets/../sheets/drive.eds")), "");
  EXPECT_THAT(found(text_of("sheets/none.eds")), HasSubstr("cannot be read"));
}

TEST_F(ClientsText, OtherFilesAreNotEvenLookedFor) {
  for (const auto& path : {directory_ / "elsewhere.eds", std::string("../elsewhere.eds"),
                           std::string("sheets/../../elsewhere.eds"), directory_ / "etc2.eds",
                           std::string("/nowhere.eds"), std::string("/dev/zero")}) {
    const auto said = found(text_of(path));
    EXPECT_THAT(said, HasSubstr(fmt::format("is not below {}, the folder", own().string()))) << path;
    EXPECT_THAT(said, Not(HasSubstr("cannot be read"))) << path;
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  }
}

TEST_F(ClientsText, WhatIsServedMayStandElsewhere) {
  const auto text = text_of("../elsewhere.eds");
  const auto served = load_text(text, (own() / "axisd.yaml").string());
  ASSERT_TRUE(served.configuration) << findings(served);
  const auto named = named_files(*served.configuration);
  EXPECT_THAT(named, ElementsAre(directory_ / "elsewhere.eds"));
  EXPECT_EQ(found(text, named), "");
  EXPECT_THAT(found(text_of("../etc2.eds"), named), HasSubstr("is not below"));
}

TEST_F(ClientsText, SoItIsWithCertificates) {
  const auto text = text_of("sheets/drive.eds",
                            "server: { listen: '0.0.0.0:7443', tls: { certificate: /somewhere/a.crt, key: "
                            "/somewhere/a.key, client_ca: /somewhere/ca.crt } }\n");
  bool looked = false;
  const TlsCheck check = [&](const auto&) {
    looked = true;
    return std::vector<std::pair<std::string_view, Error>>();
  };
  const auto file = (own() / "axisd.yaml").string();
  const auto said = findings(load_clients_text(text, file, {}, check, Duration::max()));
  for (const auto* name : {"a.crt", "a.key", "ca.crt"})
    EXPECT_THAT(said, HasSubstr(fmt::format("/somewhere/{} is not below", name)));
  EXPECT_FALSE(looked);
  const std::set<std::string> named{"/somewhere/a.crt", "/somewhere/a.key", "/somewhere/ca.crt"};
  EXPECT_EQ(findings(load_clients_text(text, file, named, check, Duration::max())), "");
  EXPECT_TRUE(looked);
}

}  // namespace
}  // namespace axisd::config
