#include "api/axisctl/cell_view.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

cell::v1::Machine machine(const std::string& name, cell::v1::MachineState state) {
  cell::v1::Machine told;
  told.set_name(name);
  told.set_state(state);
  told.mutable_since()->set_seconds(1'800'000'000);
  told.add_axes("feeder");
  return told;
}

TEST(CellView, KnowsWhatHasChanged) {
  cell::v1::WatchMachinesResponse change;
  *change.add_machines() = machine("press-1", cell::v1::MACHINE_STATE_PRESENT);
  *change.add_machines() = machine("press-2", cell::v1::MACHINE_STATE_PRESENT);
  Machines machines;
  update(machines, change);
  change.Clear();
  *change.add_machines() = machine("press-2", cell::v1::MACHINE_STATE_SILENT);
  change.add_forgotten("press-1");
  update(machines, change);
  ASSERT_EQ(machines.size(), 1);
  EXPECT_EQ(machines.at("press-2").state(), cell::v1::MACHINE_STATE_SILENT);
}

TEST(CellView, AMachineAnswersWhetherItIsRegisteredOrNot) {
  EXPECT_TRUE(answers(machine("a", cell::v1::MACHINE_STATE_PRESENT)));
  EXPECT_TRUE(answers(machine("a", cell::v1::MACHINE_STATE_UNREGISTERED)));
  EXPECT_FALSE(answers(machine("a", cell::v1::MACHINE_STATE_SILENT)));
  EXPECT_FALSE(answers(machine("a", cell::v1::MACHINE_STATE_GONE)));
}

TEST(CellView, MachinesAsATableAndAsALine) {
  auto one = machine("press-1", cell::v1::MACHINE_STATE_PRESENT);
  one.mutable_round_trip()->set_nanos(400'000);
  one.set_version("0.1.0");
  one.set_stop_all(true);
  one.set_own(true);
  auto two = machine("press-2", cell::v1::MACHINE_STATE_SILENT);
  two.set_trouble("connection refused");
  const auto lines = machine_table({{"press-1", one}, {"press-2", two}}).lines(false);
  EXPECT_THAT(lines,
              ElementsAre(HasSubstr("ROUND TRIP"), HasSubstr("0.4 ms"), HasSubstr("connection refused")));
  EXPECT_THAT(lines[1], HasSubstr("latched"));
  EXPECT_THAT(lines[1], HasSubstr("this entrance's"));
  EXPECT_EQ(machine_line(two), "press-2  silent, since 2027-01-15T08:00:00Z, 1 axes: connection refused");
}

TEST(CellView, AMachineThatIsKnownByHandHasNoCountOfAxes) {
  auto one = machine("press-1", cell::v1::MACHINE_STATE_PRESENT);
  one.clear_axes();
  EXPECT_EQ(machine_line(one), "press-1  present, since 2027-01-15T08:00:00Z");
  EXPECT_THAT(machine_table({{"press-1", one}}).lines(false).at(1), testing::ContainsRegex("present +- "));
  one.set_configuration_revision("c0ffee");
  EXPECT_EQ(machine_line(one), "press-1  present, since 2027-01-15T08:00:00Z, 0 axes") << "it has none";
}

TEST(CellView, WarnsOfWhatMattersBeforeMachinesDo) {
  cell::v1::GetCellResponse told;
  told.set_registry(cell::v1::REGISTRY_STATE_OK);
  EXPECT_THAT(cell_warnings(told, false), IsEmpty());
  told.set_registry(cell::v1::REGISTRY_STATE_DEGRADED);
  told.mutable_registry_trouble()->set_message("etcd does not answer");
  auto& latch = *told.add_stop_all();
  latch.set_by("anna");
  latch.set_entrance("press-1");
  latch.set_reason("somebody is inside");
  EXPECT_THAT(
      cell_warnings(told, false),
      ElementsAre("cell: registry degraded: etcd does not answer",
                  "cell: all machines stopped by anna through press-1, 1970-01-01T00:00:00Z: somebody is "
                  "inside; 'axisctl release-stop --all' ends it"));
  EXPECT_THAT(cell_details(told, false), testing::Contains(HasSubstr("stop all:   by anna through press-1")));
}

TEST(CellView, OnlyAMachineThatIsLatchedIsSaidToBe) {
  cell::v1::MachineStop stop;
  stop.set_machine("press-2");
  stop.set_outcome(cell::v1::MACHINE_OUTCOME_DONE);
  stop.mutable_took()->set_nanos(12'000'000);
  EXPECT_EQ(stop_line(stop, false), "press-2: stopped and latched, answered in 12 ms");
  stop.set_outcome(cell::v1::MACHINE_OUTCOME_SILENT);
  EXPECT_THAT(stop_line(stop, false), HasSubstr("press-2: SILENT, not confirmed: "));
  stop.set_outcome(cell::v1::MACHINE_OUTCOME_FAILED);
  stop.mutable_error()->set_message("its disk is full");
  EXPECT_EQ(stop_line(stop, false), "press-2: NOT confirmed: its disk is full");
  stop.set_outcome(cell::v1::MACHINE_OUTCOME_UNSPECIFIED);  // of a newer entrance
  EXPECT_THAT(stop_line(stop, false), HasSubstr("NOT confirmed"));
}

TEST(CellView, AReleaseThatFailedSaysHowToGoOn) {
  cell::v1::MachineRelease release;
  release.set_machine("press-2");
  release.set_outcome(cell::v1::MACHINE_OUTCOME_DONE);
  EXPECT_EQ(release_line(release, false), "press-2: released");
  release.set_outcome(cell::v1::MACHINE_OUTCOME_FAILED);
  release.mutable_error()->set_message("you are no maintainer there");
  EXPECT_EQ(
      release_line(release, false),
      "press-2: refused, stays stopped: you are no maintainer there; 'axisctl --machine press-2 release-stop "
      "--all' releases it");
}

TEST(CellView, EventsOfTheCellAreOneLine) {
  cell::v1::CellEvent event;
  event.set_sequence(7);
  event.mutable_at()->set_seconds(1'800'000'000);
  event.set_text("etcd answers");
  EXPECT_EQ(cell_event_line(event), "2027-01-15T08:00:00Z  7  cell  etcd answers");
  event.set_machine("press-2");
  EXPECT_THAT(cell_event_line(event), HasSubstr("  press-2  "));
}

}  // namespace
}  // namespace axisd::axisctl
