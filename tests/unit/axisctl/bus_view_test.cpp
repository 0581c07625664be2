#include "api/axisctl/bus_view.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

v1::Bus network() {
  v1::Bus bus;
  bus.set_name("can0");
  bus.set_kind(v1::BUS_KIND_CANOPEN);
  bus.set_port("can0");
  bus.set_baud(1'000'000);
  bus.mutable_network()->set_link(v1::NETWORK_LINK_BUS_OFF);
  return bus;
}

TEST(BusView, EachKindHasATableOfItsOwn) {
  v1::ListBusesResponse buses;
  *buses.add_buses() = network();
  auto& line = *buses.add_buses();
  line.set_name("line-a");
  line.set_open(true);
  line.set_simulated(true);
  EXPECT_THAT(network_table(buses).lines(false), ElementsAre(HasSubstr("INTERFACE"), HasSubstr("bus off")));
  EXPECT_THAT(line_table(buses).lines(false), ElementsAre(HasSubstr("PORT"), HasSubstr("open, simulated")));
}

TEST(BusView, TheStateSaysTheLinkAndWhy) {
  auto bus = network();
  EXPECT_EQ(bus_state(bus), "bus off");
  bus.mutable_error()->set_message("no answer");
  EXPECT_EQ(bus_state(bus).find("bus off: no answer"), 0U);
  bus.clear_error();
  bus.set_open(true);
  bus.mutable_network()->set_link(v1::NETWORK_LINK_UP);
  bus.set_simulated(true);
  EXPECT_EQ(bus_state(bus), "up, simulated");
}

TEST(BusView, ASoundLinkThatNobodyWouldCycleIsTold) {
  auto bus = network();
  bus.set_open(true);
  bus.mutable_network()->set_link(v1::NETWORK_LINK_UP);
  auto& error = *bus.mutable_network()->mutable_link_helper_error();
  error.set_bus("can0");
  error.set_message("there is no link helper at /run/axisd-link.sock: No such file or directory");
  error.set_remedy("enable axisd-link.socket");
  EXPECT_EQ(bus_state(bus),
            "up, not cycled after bus-off: there is no link helper at /run/axisd-link.sock: No such file or "
            "directory; enable axisd-link.socket");
  v1::ListBusesResponse buses;
  *buses.add_buses() = bus;
  EXPECT_THAT(network_table(buses).lines(true).at(1), HasSubstr("\x1b[33mup, not cycled"));
}

TEST(BusView, DetailsSayWhetherThereIsASync) {
  auto bus = network();
  EXPECT_THAT(bus_details(bus), HasSubstr("SYNC:          none\n"));
  EXPECT_THAT(bus_details(bus), Not(HasSubstr("foreign nodes:")));
  bus.mutable_network()->mutable_sync_period()->set_nanos(10'000'000);
  bus.mutable_network()->add_foreign_nodes(22);
  EXPECT_THAT(bus_details(bus), HasSubstr("every 10 ms, not running"));
  EXPECT_THAT(bus_details(bus), HasSubstr("foreign nodes: 22\n"));
}

TEST(BusView, ObjectsAreBytesNumbersAndText) {
  v1::TransactResponse object;
  object.set_data("\x37\x02");
  object.set_value(567);
  EXPECT_THAT(object_table(0x604100, object).lines(false).at(1), HasSubstr("6041h:00  37 02    567"));
  object.set_data("YSS57");
  object.clear_value();
  EXPECT_THAT(object_table(0x100800, object).lines(false).at(1), HasSubstr("59 53 53 35 37"));
  EXPECT_THAT(object_table(0x100800, object).lines(false).at(1), HasSubstr("YSS57"));
}

}  // namespace
}  // namespace axisd::axisctl
