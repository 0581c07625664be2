// The line: who is on it, who is not what the configuration says, and many drives at once.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "devices/descriptor.hpp"
#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

std::vector<std::string> all_models() {
  std::vector<std::string> models;
  for (const auto* model : drive_models()) models.emplace_back(model->model);
  return models;
}

/// Another model answers than the configuration names: the message names both.
std::string wrong_model(const Setup& setup) {
  for (const auto& other : all_models()) {
    if (other == setup.manual.model()) continue;
    auto plant = make_plant(setup.manual, setup.variant, {});
    plant.drives = {fmt::format("node=1,model={}", other)};
    Bench bench(setup, plant, {}, false);
    const auto state =
        bench.await([](const auto& s) { return s.link_error().reason() == v1::REASON_WRONG_MODEL; },
                    "refused as another model");
    EXPECT_NE(state.link(), v1::LINK_STATE_ONLINE);
    for (const auto& name : {setup.manual.model(), other})
      EXPECT_NE(state.link_error().message().find(name), std::string::npos)
          << "it does not name " << name << ": " << state.link_error().message();
    expect_refused(bench.client.enable(), v1::REASON_WRONG_MODEL);
    bench.finish(0);
  }
  return "both named";
}

std::string one_address_twice(const Setup& setup) {
  auto plant = make_plant(setup.manual, setup.variant, {});
  plant.drives.push_back(fmt::format("node=1,model={},eeprom.0x0011=3", setup.manual.model()));
  Bench bench(setup, plant, {}, false);
  bench.pass(5s);
  const auto state = bench.state();
  const auto& text = state.link_error().message() + " " + state.link_error().remedy();
  EXPECT_NE(state.link(), v1::LINK_STATE_ONLINE);
  EXPECT_TRUE(text.find("garbled") != std::string::npos || text.find("two nodes") != std::string::npos)
      << text;
  bench.finish(0);
  return "reported";
}

/// One more drive of each model, some at another rate; nobody has them in the configuration.
std::string scan(const Setup& setup) {
  auto plant = make_plant(setup.manual, setup.variant, {});
  std::map<int, std::string> expected{{1, setup.manual.model()}};
  int node = 2;
  for (const auto& model : all_models()) {
    const Manual manual(model);
    // 0x0014 = code of 19200 where there are no switches for it (ESS42-R: 2).
    const auto slow = manual.list("bauds_dip").empty() ? "eeprom.0x0014=2" : "dip_baud=19200";
    plant.drives.push_back(fmt::format("node={},model={}", node, model));
    expected[node++] = model;
    plant.drives.push_back(fmt::format("node={},model={},{}", node, model, slow));
    expected[node++] = model;
  }
  Bench bench(setup, plant);
  expect_done(bench.client.disable());
  v1::ScanRequest request;
  request.set_bus("line");
  request.set_last_node(12);
  request.add_bauds(115200);
  request.add_bauds(19200);
  grpc::ClientContext context;
  Client::set_deadline(context);
  v1::BusService::Stub stub(bench.target->channel());
  auto reader = stub.Scan(&context, request);
  std::map<int, std::string> found;
  std::uint32_t probed = 0, total = 0;
  for (v1::ScanResponse response; reader->Read(&response);) {
    EXPECT_GE(response.probed(), probed) << "progress goes backwards";
    probed = response.probed();
    total = response.total();
    for (const auto& one : response.found()) {
      found[static_cast<int>(one.node())] = one.model();
      EXPECT_EQ(one.format(), "8N1");
      EXPECT_FALSE(one.version().empty());
      EXPECT_EQ(one.configured_as(), one.node() == 1 ? "axis" : "") << one.node();
      EXPECT_EQ(one.baud(), one.node() > 1 && one.node() % 2 == 1 ? 19200U : 115200U) << one.node();
      EXPECT_GT(one.pulses_per_revolution(), 0U);
    }
  }
  const auto status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(found, expected);
  EXPECT_EQ(probed, total);
  EXPECT_EQ(total, 24U);
  bench.await_online();
  bench.finish(0);
  return "all models";
}

Answer<v1::TransactResponse> transact(Bench& bench, std::uint32_t node, std::uint32_t address,
                                      std::optional<std::uint32_t> write = {}) {
  v1::TransactRequest request;
  request.set_bus("line");
  request.set_node(node);
  request.set_address(address);
  if (write)
    request.mutable_write()->add_values(*write);
  else
    request.set_read(1);
  return bench.client.call(&v1::BusService::Stub::Transact, request);
}

/// Nodes that are not axes: through the same queue, by name and register by register (M28).
std::string other_nodes(const Setup& setup) {
  auto plant = make_plant(setup.manual, setup.variant, {});
  plant.drives.push_back(fmt::format("node=9,model={}", setup.manual.model()));
  plant.yaml +=
      "devices:\n  fan:\n    bus: line\n    node: 9\n    model: modbus-generic\n    poll: 100 ms\n    "
      "registers:\n"
      "      speed: { address: 0x0023, type: i16, scale: 0.5, unit: rpm, access: rw }\n"
      "      version: { address: 0x0001 }\n";
  Bench bench(setup, plant);
  bench.pass(1s);
  const auto read = transact(bench, 1, 0x0000);
  if (!read.ok() || read->values_size() != 1) throw Broken("Transact: " + read.status.error_message());
  EXPECT_TRUE(read->values(0) >= 0x0301 && read->values(0) <= 0x0305);
  const auto refused = transact(bench, 1, 0x0027, 2);
  EXPECT_FALSE(refused.ok()) << "a start command for an axis, past the axis";
  EXPECT_TRUE(transact(bench, 9, 0x0021, 321).ok());
  EXPECT_EQ(transact(bench, 9, 0x0021)->values(0), 321U);
  const auto hole = transact(bench, 9, 0x0019);
  EXPECT_EQ(hole.error.reason(), v1::REASON_REFUSED) << hole.status.error_message();
  EXPECT_EQ(hole.error.native_code(), 3U);

  v1::WriteDeviceRequest write;
  write.set_device("fan");
  write.set_register_("speed");
  write.set_value(100);
  const auto written = bench.client.call(&v1::BusService::Stub::WriteDevice, write);
  EXPECT_TRUE(written.ok()) << written.status.error_message();
  write.set_register_("version");
  EXPECT_FALSE(bench.client.call(&v1::BusService::Stub::WriteDevice, write).ok()) << "it is read-only";
  bench.pass(1s);
  const auto devices = bench.client.call(&v1::BusService::Stub::ListDevices, v1::ListDevicesRequest());
  if (devices->devices_size() != 1) throw Broken("ListDevices: " + devices->ShortDebugString());
  const auto& fan = devices->devices(0);
  EXPECT_EQ(fan.link(), v1::LINK_STATE_ONLINE);
  EXPECT_DOUBLE_EQ(fan.values(0).value(), 100);
  EXPECT_EQ(fan.values(0).unit(), "rpm");
  EXPECT_DOUBLE_EQ(fan.values(1).value(), 0x0100);
  bench.finish(0);
  return "yes";
}

/// Thirty drives of all models on one line, one YAML: all up within 5 s of line time, and fresh from then on.
/// A state takes about 9 ms of the line: five a second of each, the default, would be more than it can carry.
std::string thirty_drives(const Setup& setup) {
  const auto models = all_models();
  Plant plant{.yaml =
                  "machine: thirty\nbuses:\n  line: { modbus_rtu: { port: sim, baud: 115200 } }\naxes:\n"};
  for (int i = 0; i < 30; ++i) {
    const Manual manual(models[static_cast<std::size_t>(i) % models.size()]);
    const auto name = i == 0 ? std::string("axis") : fmt::format("axis{}", i);
    plant.yaml += fmt::format(
        "  {}:\n    bus: line\n    node: {}\n    model: {}\n    unit: mm\n"
        "    scale: {{ microstep: 4000 pulses/rev, travel: 10 mm/rev, invert: {} }}\n"
        "    limits: {{ position: [0, 400], velocity: 100 mm/s }}\n"
        "    homing: {{ method: negative_limit, velocity: 50 mm/s, search_velocity: 5 mm/s }}\n"
        "    inputs: {{ X0: home, X1: positive_limit, X2: {{ function: negative_limit, active: low }} }}\n"
        "    outputs: {{ Y0: alarm, Y1: in_position }}\n    poll: {{ idle: 500 ms }}\n",
        name, i + 1, manual.model(), setup.variant.invert);
    plant.drives.push_back(fmt::format("node={},model={}", i + 1, manual.model()));
  }
  Bench bench(setup, plant, {}, false);
  const auto online = [&] {
    const auto axes = bench.client.call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest());
    EXPECT_EQ(axes->axes_size(), 30);
    return std::ranges::count_if(axes->axes(), [](const auto& s) {
      return s.link() == v1::LINK_STATE_ONLINE && s.drift().empty() && !s.has_fault() &&
             s.age().seconds() == 0;
    });
  };
  int tenths = 0;
  for (; tenths < 300 && online() < 30; ++tenths) bench.pass(100ms);
  EXPECT_LE(tenths, 50) << "5 s of line time";
  bench.pass(5s);
  EXPECT_EQ(online(), 30) << "not healthy";
  bench.finish(0);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"wrong_model", "another model than configured", &wrong_model},
    {"one_address_twice", "two drives on one address", &one_address_twice},
    {"scan", "bus scan, several baud rates", &scan},
    {"other_nodes", "other devices on the line", &other_nodes},
    {"thirty_drives", "30 drives of all models on one line at 115200, up within 5 s", &thirty_drives},
};

}  // namespace

std::span<const Scenario> bus_scenarios() { return scenarios; }

}  // namespace axisd::conformance
