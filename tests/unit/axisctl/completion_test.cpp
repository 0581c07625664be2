#include "api/axisctl/completion.hpp"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

class Completion : public testing::Test {
 protected:
  Place at(const std::vector<std::string>& words) { return place_of(*app_, words); }
  std::vector<std::string> words(const std::vector<std::string>& typed) {
    std::vector<std::string> texts;
    for (const auto& one : at(typed).words) texts.push_back(one.text);
    return texts;
  }

 private:
  Invocation invocation_;
  std::unique_ptr<CLI::App> app_ = make_app(invocation_);
};

TEST_F(Completion, FollowsSubcommands) {
  EXPECT_THAT(words({""}), Contains("move"));
  EXPECT_THAT(words({"command", ""}), Contains("cancel"));
  EXPECT_THAT(words({"state", "feeder", ""}), IsEmpty());
  EXPECT_EQ(at({"state", "feeder", ""}).names, Names::none);
}

TEST_F(Completion, AsksForWhatAnArgumentIs) {
  EXPECT_EQ(at({"move", ""}).names, Names::axes);
  EXPECT_EQ(at({"stop", "feeder", ""}).names, Names::axes);
  EXPECT_EQ(at({"move", "feeder", ""}).names, Names::none);
  EXPECT_EQ(at({"trace", ""}).names, Names::buses);
  EXPECT_EQ(at({"group", "stop", ""}).names, Names::groups);
  EXPECT_EQ(at({"group", "move", ""}).names, Names::targets);
  EXPECT_EQ(at({"group", "move", "feeder=1", ""}).names, Names::axes);
  EXPECT_EQ(at({"lease", "acquire", ""}).names, Names::axes_and_groups);
  EXPECT_EQ(at({"check", ""}).names, Names::files);
  EXPECT_EQ(at({"device", "write", ""}).names, Names::devices);
  EXPECT_EQ(at({"device", "write", "valves", ""}).names, Names::device_values);
}

TEST_F(Completion, KnowsWhoseParameters) {
  const auto read = at({"drive", "read", "feeder", "sta"});
  EXPECT_EQ(read.names, Names::parameters);
  EXPECT_EQ(read.subject, "feeder");
  EXPECT_EQ(read.behind, "");
  EXPECT_EQ(at({"drive", "parameters", "feeder", "sta"}).names, Names::parameters);
  EXPECT_EQ(at({"drive", "write", "feeder", "sta"}).behind, "=");
  EXPECT_EQ(at({"drive", "write", "feeder", "start_speed=1"}).names, Names::none);
}

TEST_F(Completion, KnowsOptionsAndTheirValues) {
  EXPECT_THAT(words({"move", "feeder", "-"}), Contains("--relative"));
  EXPECT_THAT(words({"move", "feeder", "--"}), Contains("--json"));
  EXPECT_THAT(words({"move", "--velocity", ""}), IsEmpty());
  EXPECT_EQ(at({"move", "--velocity", "5", ""}).names, Names::axes);
  EXPECT_EQ(at({"group", "stop", "--axis", ""}).names, Names::axes);
  EXPECT_EQ(at({"--tls-ca", ""}).names, Names::files);
  EXPECT_THAT(words({"explain", "feeder", ""}), Contains("home"));
  EXPECT_THAT(words({"move", "feeder", "--", "-"}), Not(Contains("--json")));
}

TEST_F(Completion, GoesOnBehindCommasAndEqualSigns) {
  const auto kinds = at({"events", "--kind=terminal-edge,st"});
  EXPECT_EQ(kinds.before, "--kind=terminal-edge,");
  EXPECT_EQ(kinds.typed, "st");
  EXPECT_THAT(words({"events", "--kind", ""}), Contains("state-change"));
}

TEST_F(Completion, KeepsWhatSaysWhereTheDaemonIs) {
  EXPECT_THAT(at({"--server", "press-1:7443", "move", "--tls-ca=ca.crt", ""}).connection,
              ElementsAre("--server", "press-1:7443", "--tls-ca", "ca.crt"));
}

TEST_F(Completion, KeepsWhichCellAndMachine) {
  EXPECT_THAT(at({"--cell=press-1", "--machine", "press-2", "move", ""}).connection,
              ElementsAre("--cell", "press-1", "--machine", "press-2"));
  EXPECT_EQ(at({"--machine", ""}).names, Names::machines);
  EXPECT_EQ(at({"list", ""}).names, Names::machines);
  EXPECT_EQ(at({"move", "press-2/"}).names, Names::axes);
}

TEST_F(Completion, HasAScriptForEachShell) {
  for (const auto& shell : completion_shells())
    EXPECT_NE(completion_script(shell).find("complete-words"), std::string::npos) << shell;
}

}  // namespace
}  // namespace axisd::axisctl
