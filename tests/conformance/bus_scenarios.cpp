// The bus: who is on it, who is not what the configuration says, and many drives at once.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// Refused, and the message names what was expected and what was found instead.
void expect_wrong_model(Bench& bench, const std::string& found) {
  const auto state =
      bench.await([](const auto& s) { return s.link_error().reason() == v1::REASON_WRONG_MODEL; },
                  "refused as another model");
  EXPECT_NE(state.link(), v1::LINK_STATE_ONLINE);
  for (const auto& name : {bench.setup.manual.model(), found})
    EXPECT_NE(state.link_error().message().find(name), std::string::npos)
        << "it does not name " << name << ": " << state.link_error().message();
  expect_refused(bench.client.enable(), v1::REASON_WRONG_MODEL);
  bench.finish(0);
}

/// Another model answers than the configuration names; where there is none for this kind of bus: a drive that
/// says so of itself.
std::string wrong_model(const Setup& setup) {
  const auto& manual = setup.manual;
  const auto models = same_bus(manual);
  for (const auto& other : models) {
    if (other.model() == manual.model()) continue;
    auto plant = make_plant(manual, setup.variant, {});
    plant.drives = {fmt::format("node=1,model={}", other.model())};
    Bench bench(setup, plant, {}, false);
    expect_wrong_model(bench, other.model());
  }
  if (models.size() == 1) {
    Bench bench(setup);
    bench.outside(fmt::format("poke @1 {} 0x1BAD", manual.number("model_code_parameter")));
    bench.target->restart();
    expect_wrong_model(bench, "1BAD");
  }
  return "both named";
}

/// Two numbers of the model that move nothing, the first one to be changed.
std::pair<const ManualParameter*, const ManualParameter*> device_numbers(const Manual& manual) {
  if (!manual.has("device_numbers"))
    return {manual.find_title("Start speed"), manual.find_title("Microstep setting")};
  const auto addresses = manual.list("device_numbers");
  const auto at = [&](std::size_t i) {
    return manual.find(static_cast<std::uint32_t>(std::stoll(addresses.at(i), nullptr, 0)));
  };
  return {at(0), at(1)};
}

std::string one_address_twice(const Setup& setup) {
  const auto& manual = setup.manual;
  auto plant = make_plant(manual, setup.variant, {});
  plant.drives.push_back(
      fmt::format("node=1,model={},eeprom.{}=3", manual.model(), device_numbers(manual).second->address));
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

/// The part of --drive that sets this rate: by switches where there are some, else by its code.
std::string set_to_rate(const Manual& manual, const std::string& baud) {
  if (!manual.list("bauds_dip").empty()) return "dip_baud=" + baud;
  const auto codes = manual.list("bauds_custom");
  return fmt::format("eeprom.{}={}", manual.find_title("Custom baud rate")->address,
                     std::ranges::find(codes, baud) - codes.begin());
}

/// One more drive of each model, on a serial line one at another rate, too (the rate of a CAN interface is
/// not the daemon's to change); nobody has them in the configuration.
std::string scan(const Setup& setup) {
  constexpr std::uint32_t slow = 19200;
  const auto rate = static_cast<std::uint32_t>(setup.manual.highest_baud());
  const auto formats = setup.manual.list("formats");
  const bool serial = !formats.empty();
  auto plant = make_plant(setup.manual, setup.variant, {});
  // What only its data sheet describes is named by its profile (CiA 402).
  const bool described = setup.manual.has("data_sheet");
  std::map<int, std::pair<std::string, std::uint32_t>> expected{{1, {setup.manual.model(), rate}}}, found;
  int node = 2;
  for (const auto& manual : same_bus(setup.manual)) {
    plant.drives.push_back(fmt::format("node={},model={}", node, manual.model()));
    expected[node++] = {manual.model(), rate};
    if (!serial) continue;
    plant.drives.push_back(
        fmt::format("node={},model={},{}", node, manual.model(), set_to_rate(manual, std::to_string(slow))));
    expected[node++] = {manual.model(), slow};
  }
  Bench bench(setup, plant);
  expect_done(bench.client.disable());
  v1::ScanRequest request;
  request.set_bus("line");
  request.set_last_node(12);
  if (serial) {
    request.add_bauds(rate);
    request.add_bauds(slow);
  }
  grpc::ClientContext context;
  Client::set_deadline(context);
  v1::BusService::Stub stub(bench.target->channel());
  auto reader = stub.Scan(&context, request);
  std::uint32_t probed = 0, total = 0;
  for (v1::ScanResponse response; reader->Read(&response);) {
    EXPECT_GE(response.probed(), probed) << "progress goes backwards";
    probed = response.probed();
    total = response.total();
    for (const auto& one : response.found()) {
      found[static_cast<int>(one.node())] = {one.model(), one.baud()};
      EXPECT_EQ(one.format(), serial ? formats.front() : "");
      EXPECT_NE(serial, one.version().empty()) << "a CAN node has an identity instead";
      EXPECT_NE(serial, one.has_product());
      EXPECT_EQ(one.configured_as(), one.node() == 1 ? "axis" : "") << one.node();
      EXPECT_EQ(one.pulses_per_revolution() == 0, described);
    }
  }
  const auto status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(found, expected);
  EXPECT_EQ(probed, total);
  EXPECT_EQ(total, serial ? 24U : 12U);
  bench.await_online();
  bench.finish(0);
  return described ? "by its profile" : "all models";
}

/// One exchange past all axes: a register, or an object with its type.
Answer<v1::TransactResponse> transact(Bench& bench, std::uint32_t node, std::uint32_t address,
                                      std::optional<std::uint32_t> write = {}) {
  const auto& manual = bench.setup.manual;
  v1::TransactRequest request;
  request.set_bus("line");
  request.set_node(node);
  request.set_address(address);
  if (manual.bus() == "canopen") {
    const auto* object = manual.find(address);
    const auto type =
        object != nullptr && object->type == "U32" ? v1::PARAMETER_TYPE_UINT32 : v1::PARAMETER_TYPE_UINT16;
    if (write) {
      auto& number = *request.mutable_write_object()->mutable_number();
      number.set_type(type);
      number.set_value(*write);
    } else {
      request.mutable_read_object()->set_type(type);
    }
  } else if (write) {
    request.mutable_write()->add_values(*write);
  } else {
    request.set_read(1);
  }
  return bench.client.call(&v1::BusService::Stub::Transact, request);
}

std::int64_t number_read(Bench& bench, std::uint32_t node, std::uint32_t address) {
  const auto read = transact(bench, node, address);
  if (!read.ok()) throw Broken("Transact: " + read.status.error_message());
  if (read->has_value()) return read->value();
  if (read->values_size() != 1) throw Broken("Transact: " + read->ShortDebugString());
  return read->values(0);
}

/// Two numbers of the model, as a node that is no axis.
std::string device_lines(const Manual& manual) {
  const auto [speed, microstep] = device_numbers(manual);
  const auto at = [&](const ManualParameter& one) {
    const auto where = manual.bus() == "canopen"
                           ? fmt::format("object: {:04X}h:{:02X}", one.address >> 8U, one.address & 0xFFU)
                           : fmt::format("address: 0x{:04X}", one.address);
    return fmt::format("{}, type: {}", where, one.type == "U32" ? "u32" : "u16");
  };
  const bool objects = manual.bus() == "canopen";
  return fmt::format(
      "devices:\n  fan:\n    bus: line\n    node: 9\n    model: {}\n    poll: 100 ms\n    {}:\n"
      "      speed: {{ {}, scale: 0.5, unit: rpm, access: rw }}\n"
      "      microstep: {{ {} }}\n",
      objects ? "canopen-generic" : "modbus-generic", objects ? "objects" : "registers", at(*speed),
      at(*microstep));
}

void expect_named_values(Bench& bench) {
  const auto& microstep = *device_numbers(bench.setup.manual).second;
  v1::WriteDeviceRequest write;
  write.set_device("fan");
  write.set_register_("speed");
  write.set_value(100);
  const auto written = bench.client.call(&v1::BusService::Stub::WriteDevice, write);
  EXPECT_TRUE(written.ok()) << written.status.error_message();
  write.set_register_("microstep");
  EXPECT_FALSE(bench.client.call(&v1::BusService::Stub::WriteDevice, write).ok()) << "it is read-only";
  bench.pass(1s);
  const auto devices = bench.client.call(&v1::BusService::Stub::ListDevices, v1::ListDevicesRequest());
  if (devices->devices_size() != 1) throw Broken("ListDevices: " + devices->ShortDebugString());
  const auto& fan = devices->devices(0);
  EXPECT_EQ(fan.link(), v1::LINK_STATE_ONLINE);
  EXPECT_DOUBLE_EQ(fan.values(0).value(), 100);
  EXPECT_EQ(fan.values(0).unit(), "rpm");
  EXPECT_DOUBLE_EQ(fan.values(1).value(), static_cast<double>(*microstep.default_value));
}

/// Nodes that are not axes: through the same queue, by name and by single exchanges (M28).
std::string other_nodes(const Setup& setup) {
  const auto& manual = setup.manual;
  auto plant = make_plant(manual, setup.variant, {});
  plant.drives.push_back(fmt::format("node=9,model={}", manual.model()));
  plant.yaml += device_lines(manual);
  Bench bench(setup, plant);
  bench.pass(1s);
  const auto at = [&](const std::string& ability) {
    return static_cast<std::uint32_t>(manual.number(ability));
  };
  const auto code = number_read(bench, 1, at("model_code_parameter"));
  const auto codes = manual.list("model_codes");
  EXPECT_TRUE(std::ranges::any_of(codes, [&](const auto& one) {
    return std::stoll(one, nullptr, 0) == code;
  })) << code;
  EXPECT_FALSE(transact(bench, 1, at("start_parameter"), 2).ok())
      << "a start command for an axis, past the axis";
  const auto* ramp = manual.find_title("Acceleration time");
  const auto time = ramp != nullptr ? ramp->address : device_numbers(manual).first->address;
  EXPECT_TRUE(transact(bench, 9, time, 321).ok());
  EXPECT_EQ(number_read(bench, 9, time), 321);
  const auto hole = transact(bench, 9, at("hole"));
  EXPECT_FALSE(hole.ok());
  EXPECT_EQ(hole.error.native_code(), manual.number("hole_error"));
  expect_named_values(bench);
  bench.finish(0);
  return "yes";
}

/// Empty: the model needs none.
std::string data_sheet_line(const Manual& manual) {
  const auto keys = data_sheet_keys(manual);
  return keys.empty() ? keys : fmt::format("    drive: {{ {} }}\n", keys);
}

/// Switches and, where it has outputs, two of them, as the lines of an axis.
std::string switch_lines(const Manual& manual, bool invert) {
  const std::string functions[] = {"home", "positive_limit", "negative_limit"};
  std::string inputs;
  for (const auto& function : functions) {
    const auto only = manual.terminal_of(function_of_drive(function, invert));
    const bool low = only.empty() && function == "negative_limit";
    inputs += fmt::format("{}{}: {}", inputs.empty() ? "" : ", ",
                          only.empty() ? fmt::format("X{}", &function - functions) : only,
                          low ? "{ function: negative_limit, active: low }" : function);
  }
  const bool outputs = !manual.list("outputs").empty();
  return fmt::format("    inputs: {{ {} }}\n{}", inputs,
                     outputs ? "    outputs: { Y0: alarm, Y1: in_position }\n" : "");
}

/// As many drives as a bus carries, of all models for it, one YAML: all up within 5 s of bus time, and fresh
/// from then on. At 115200 baud a state takes about 9 ms of the line: five a second of each, the default,
/// would be more than it can carry. At 1 Mbit/s the answers of 32 drives to one SYNC take about 8 ms.
std::string full_bus(const Setup& setup) {
  const auto models = same_bus(setup.manual);
  const auto count = static_cast<int>(setup.manual.number("max_drives"));
  Plant plant{.yaml = bus_lines(setup.manual, 0, 20ms), .drives = {}};
  for (int i = 0; i < count; ++i) {
    const auto& manual = models[static_cast<std::size_t>(i) % models.size()];
    const auto& model = manual.model();
    plant.yaml += fmt::format(
        "  {}:\n    bus: line\n    node: {}\n    model: {}\n    unit: mm\n"
        "    scale: {{ microstep: 4000 pulses/rev, travel: 10 mm/rev, invert: {} }}\n"
        "    limits: {{ position: [0, 400], velocity: 100 mm/s }}\n"
        "    homing: {{ method: negative_limit, velocity: 50 mm/s, search_velocity: 5 mm/s }}\n"
        "{}{}    poll: {{ idle: 500 ms }}\n",
        i == 0 ? "axis" : fmt::format("axis{}", i), i + 1, model, setup.variant.invert,
        switch_lines(manual, setup.variant.invert), data_sheet_line(manual));
    plant.drives.push_back(fmt::format("node={},model={}", i + 1, model));
  }
  Bench bench(setup, plant, {}, false);
  const auto online = [&] {
    const auto axes = bench.client.call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest());
    EXPECT_EQ(axes->axes_size(), count);
    return std::ranges::count_if(axes->axes(), [](const auto& s) {
      return s.link() == v1::LINK_STATE_ONLINE && s.drift().empty() && !s.has_fault() &&
             s.age().seconds() == 0;
    });
  };
  int tenths = 0;
  for (; tenths < 300 && online() < count; ++tenths) bench.pass(100ms);
  EXPECT_LE(tenths, 50) << "5 s of bus time";
  bench.pass(5s);
  EXPECT_EQ(online(), count) << "not healthy";
  bench.finish(0);
  return std::to_string(count);
}

constexpr Scenario scenarios[] = {
    {"wrong_model", "another model than configured", &wrong_model},
    {"one_address_twice", "two drives on one address", &one_address_twice},
    {"scan", "bus scan", &scan},
    {"other_nodes", "other devices on the bus", &other_nodes},
    {"full_bus", "drives on one bus (its models mixed, at the rate of its switches), up within 5 s",
     &full_bus},
};

}  // namespace

std::span<const Scenario> bus_scenarios() { return scenarios; }

}  // namespace axisd::conformance
