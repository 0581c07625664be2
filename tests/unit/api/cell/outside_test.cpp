// What comes from others: names, keys of etcd, files, calls; and who is told what.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "api/cell/etcd/keys.hpp"
#include "api/cell/event_log.hpp"
#include "api/cell/kept_file.hpp"
#include "api/cell/names.hpp"
#include "api/cell/open_calls.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell {
namespace {

TEST(Names, OfMachines) {
  for (const auto* name : {"a", "press-1", "press_2", "m09"}) EXPECT_TRUE(is_machine_name(name)) << name;
  for (const auto& name :
       {std::string(), std::string("1a"), std::string("Press"), std::string("a/b"), std::string("a b"),
        std::string("a\n"), std::string(65, 'a'), std::string("-a"), std::string("\xC3\xA4")})
    EXPECT_FALSE(is_machine_name(name)) << name;
  EXPECT_TRUE(is_machine_name(std::string(64, 'a')));
}

TEST(Names, OfAddresses) {
  for (const auto* address : {"press-1.factory:7443", "10.0.0.1:1", "[::1]:7443", "unix:/run/axisd.sock"})
    EXPECT_TRUE(is_address(address)) << address;
  for (const auto& address :
       {std::string("press-1"), std::string("a:0"), std::string("a:70000"), std::string(":1"),
        std::string("a b:1"), std::string("unix:x"), std::string(300, 'a') + ":1"})
    EXPECT_FALSE(is_address(address)) << address;
}

TEST(Names, OfStops) {
  for (const auto* path : {"/axisd.v1.AxisService/Stop", "/axisd.v1.StopService/StopAll",
                           "/axisd.v1.SystemService/StopAll", "/axisd.v1.GroupService/GroupHalt"}) {
    EXPECT_TRUE(is_stop(path)) << path;
    EXPECT_TRUE(is_never_counted(path)) << path;
  }
  for (const auto* path : {"/axisd.v1.AxisService/Jog", "/axisd.v1.StopService/Jog",
                           "/axisd.v1.AxisService/StopX", "/other/Stop", "/axisd.v1.AxisService/Disable"})
    EXPECT_FALSE(is_stop(path)) << path;
  EXPECT_TRUE(is_never_counted("/axisd.v1.AxisService/Disable"));
  EXPECT_TRUE(is_never_counted("/axisd.v1.GroupService/RenewPrepared"));
  EXPECT_FALSE(is_never_counted("/axisd.v1.AxisService/MoveAbsolute"));
}

class EtcdKeys : public ::testing::Test {
 protected:
  static kept::Registration good() {
    kept::Registration made;
    made.set_name("press-2");
    made.set_axisd_address("press-2:7443");
    made.set_stop_address("press-2:7444");
    made.add_axes("feeder");
    return made;
  }
  static bool is_taken(const kept::Registration& made) {
    return etcd::registration_of("press-2", made.SerializeAsString()).has_value();
  }
  const etcd::Keys keys_{"hall-1"};
};

TEST_F(EtcdKeys, AreBelowTheCell) {
  EXPECT_EQ(keys_.prefix(), "/axisd/hall-1/");
  EXPECT_EQ(keys_.prefix_end(), "/axisd/hall-10");
  EXPECT_EQ(keys_.of_machine("press-2"), "/axisd/hall-1/machines/press-2");
  EXPECT_EQ(keys_.machine_of("/axisd/hall-1/machines/press-2"), "press-2");
}

TEST_F(EtcdKeys, OfOthersAreNobodys) {
  for (const auto* key :
       {"/axisd/hall-1/machines/", "/axisd/hall-1/machines/a/b", "/axisd/hall-1/machines/UPPER",
        "/axisd/hall-1/stop_all", "/axisd/hall-2/machines/press-2", ""})
    EXPECT_FALSE(keys_.machine_of(key)) << key;
}

TEST_F(EtcdKeys, ARegistrationIsBelievedOnlyIfItCanBeOne) {
  EXPECT_TRUE(is_taken(good()));
  EXPECT_FALSE(etcd::registration_of("press-2", "no message \xFF\xFF"));
  EXPECT_FALSE(etcd::registration_of("press-3", good().SerializeAsString())) << "another's name";
  EXPECT_FALSE(etcd::registration_of("press-2", std::string(200 * 1024, 'x')));
  auto changed = good();
  changed.set_axisd_address("nowhere");
  EXPECT_FALSE(is_taken(changed));
  changed = good();
  changed.set_cell_address("evil\nline:1");
  EXPECT_FALSE(is_taken(changed));
  changed = good();
  changed.add_axes("../x");
  EXPECT_FALSE(is_taken(changed));
  changed = good();
  for (int i = 0; i < 1100; ++i) changed.add_axes("a");
  EXPECT_FALSE(is_taken(changed));
  changed = good();
  changed.set_version(std::string(200, '1'));
  EXPECT_FALSE(is_taken(changed));
}

class KeptFile : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directory(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::string folder_ = ::testing::TempDir() + "kept-" + std::to_string(::getpid());
  const std::string path_ = folder_ + "/file";
};

TEST_F(KeptFile, HoldsWhatWasWritten) {
  EXPECT_EQ(read_kept(path_).value(), std::nullopt);
  ASSERT_TRUE(write_kept(path_, "one"));
  ASSERT_TRUE(write_kept(path_, std::string("two\0three", 9)));
  EXPECT_EQ(read_kept(path_).value(), std::string("two\0three", 9));
}

TEST_F(KeptFile, ADamagedOneIsPutAside) {
  for (const auto* damage : {"", "garbage"}) {
    ASSERT_TRUE(write_kept(path_, "content"));
    std::ofstream(path_, std::ios::binary) << damage;
    const auto read = read_kept(path_);
    ASSERT_FALSE(read) << damage;
    EXPECT_EQ(read.error().reason, Reason::storage);
    EXPECT_TRUE(std::filesystem::exists(path_ + ".damaged"));
    EXPECT_EQ(read_kept(path_).value(), std::nullopt) << "the next start finds none";
  }
}

TEST_F(KeptFile, OneChangedByteIsSeen) {
  ASSERT_TRUE(write_kept(path_, "content of some length"));
  std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(6);
  file.put('X');
  file.close();
  EXPECT_FALSE(read_kept(path_));
}

TEST_F(KeptFile, AFolderThatIsNotThereIsAnError) {
  EXPECT_EQ(write_kept(folder_ + "/none/file", "x").error().reason, Reason::storage);
}

TEST(EventLog, GoesOnBehindTheCursor) {
  EventLog log("run-1");
  for (int i = 0; i < 3; ++i) log.add({});
  v1::WatchEventsRequest request;
  EXPECT_EQ(log.cursor_of(request), 3U) << "only what is new";
  request.set_instance_id("run-1");
  request.set_after_sequence(1);
  auto cursor = log.cursor_of(request);
  const auto response = log.after(cursor);
  ASSERT_EQ(response.events_size(), 2);
  EXPECT_EQ(response.events(0).sequence(), 2U);
  EXPECT_EQ(response.lost(), 0U);
  EXPECT_EQ(cursor, 3U);
  request.set_instance_id("run-0");
  EXPECT_EQ(log.cursor_of(request), 0U) << "another run: all that is kept";
}

TEST(EventLog, TellsHowManyAreLost) {
  EventLog log("run-1");
  for (std::size_t i = 0; i < EventLog::most_of_kind + 10; ++i) log.add({});
  std::uint64_t cursor = 0;
  auto response = log.after(cursor);
  EXPECT_EQ(response.lost(), 10U);
  EXPECT_EQ(response.events(0).sequence(), 11U);
  EXPECT_EQ(response.events_size(), EventLog::most_at_once);
  EXPECT_LT(response.cursor(), response.newest());
  EXPECT_EQ(log.after(cursor).lost(), 0U);
}

v1::CellEvent move_of(const std::string& client) {
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_GROUP_MOVE);
  event.mutable_group_move()->set_client(client);
  return event;
}

/// M32.
TEST(EventLog, WhoFloodsItPushesOutOnlyTheirOwn) {
  EventLog log("run-1");
  v1::CellEvent birth;
  birth.set_kind(v1::CELL_EVENT_KIND_MACHINE);
  log.add(birth);
  log.add(move_of("anna"));
  for (std::size_t i = 0; i < 3 * EventLog::most_of_kind; ++i) log.add(move_of("boss"));
  std::uint64_t cursor = 0;
  const auto response = log.after(cursor);
  EXPECT_EQ(response.events(0).kind(), v1::CELL_EVENT_KIND_MACHINE);
  EXPECT_EQ(response.events(1).group_move().client(), "anna");
  EXPECT_EQ(response.events(2).group_move().client(), "boss");
  EXPECT_EQ(response.lost(), 2 * EventLog::most_of_kind + 1);
  while (cursor < log.newest()) EXPECT_EQ(log.after(cursor).lost(), 0U);
  EXPECT_EQ(log.after(cursor).events_size(), 0);
}

TEST(OpenCalls, NoCallerTakesThePlacesOfAllOthers) {
  OpenCalls calls({.all = 5, .each = 3, .stops_each = 2});
  using Kind = OpenCalls::Kind;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(calls.enter("a", Kind::counted));
  EXPECT_FALSE(calls.enter("a", Kind::counted));
  EXPECT_TRUE(calls.enter("a", Kind::stop)) << "a stop has a place of its own";
  EXPECT_TRUE(calls.enter("b", Kind::counted));
  EXPECT_TRUE(calls.enter("b", Kind::counted));
  EXPECT_FALSE(calls.enter("c", Kind::counted)) << "of all";
  EXPECT_TRUE(calls.enter("c", Kind::stop));
  calls.leave("a", Kind::counted);
  EXPECT_TRUE(calls.enter("c", Kind::counted));
  EXPECT_EQ(calls.open(), 7);
}

TEST(Status, CarriesItsDetail) {
  const auto status =
      to_status(grpc::StatusCode::UNAVAILABLE, axisd::v1::REASON_OFFLINE, "press-2 is silent", "look");
  EXPECT_EQ(status.error_message(), "press-2 is silent; look");
  const auto detail = detail_of(status);
  EXPECT_EQ(detail.reason(), axisd::v1::REASON_OFFLINE);
  EXPECT_EQ(detail.remedy(), "look");
}

TEST(Status, WithoutADetailIsToldAsItIs) {
  const auto detail = detail_of(grpc::Status(grpc::StatusCode::UNAVAILABLE, "connection refused"));
  EXPECT_EQ(detail.reason(), axisd::v1::REASON_OFFLINE);
  EXPECT_EQ(detail.message(), "connection refused");
  EXPECT_EQ(detail.outcome(), axisd::v1::OUTCOME_UNKNOWN);
}

}  // namespace
}  // namespace axisd::cell
