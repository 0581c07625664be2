// Parameters: the whole catalogue against the manual's table, reading, writing, saving, refusals.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

std::string access_name(v1::ParameterAccess access) {
  switch (access) {
    case v1::PARAMETER_ACCESS_READ_ONLY:
      return "RO";
    case v1::PARAMETER_ACCESS_READ_WRITE:
      return "RW";
    case v1::PARAMETER_ACCESS_READ_WRITE_SAVED:
      return "RW/S";
    case v1::PARAMETER_ACCESS_WRITE_ONLY:
      return "WO";
    default:
      return "?";
  }
}

v1::ListParametersResponse list(Bench& bench) {
  v1::ListParametersRequest request;
  request.set_axis("axis");
  const auto answer = bench.client.call(&v1::DriveService::Stub::ListParameters, request);
  if (!answer.ok()) throw Broken("ListParameters: " + answer.status.error_message());
  return answer.response;
}

Answer<v1::ReadParametersResponse> read(Bench& bench, const std::vector<std::string>& names) {
  v1::ReadParametersRequest request;
  request.set_axis("axis");
  for (const auto& name : names) request.add_names(name);
  return bench.client.call(&v1::DriveService::Stub::ReadParameters, request);
}

using Values = std::vector<std::pair<std::string, std::int64_t>>;

Answer<v1::WriteParametersResponse> write(Bench& bench, const Values& values) {
  v1::WriteParametersRequest request;
  request.set_axis("axis");
  for (const auto& [name, value] : values) {
    auto& one = *request.add_values();
    one.set_name(name);
    one.set_value(value);
  }
  return bench.client.call(&v1::DriveService::Stub::WriteParameters, request);
}

std::string type_name(v1::ParameterType type) {
  switch (type) {
    case v1::PARAMETER_TYPE_UINT8:
      return "U8";
    case v1::PARAMETER_TYPE_INT8:
      return "I8";
    case v1::PARAMETER_TYPE_UINT16:
      return "U16";
    case v1::PARAMETER_TYPE_INT16:
      return "I16";
    case v1::PARAMETER_TYPE_UINT32:
      return "U32";
    case v1::PARAMETER_TYPE_INT32:
      return "I32";
    default:
      return "?";
  }
}

/// What starts write (M6): what it holds at rest is the daemon's canary.
bool is_for_motion(const Manual& manual, std::uint32_t address) {
  const auto all = manual.list("motion_parameters");
  return std::ranges::find(all, fmt::format("0x{:04X}", address)) != all.end();
}

void compare(const v1::Parameter& parameter, const ManualParameter& manual) {
  SCOPED_TRACE(fmt::format("0x{:04X} {} ({})", manual.address, parameter.name(), manual.title));
  EXPECT_EQ(access_name(parameter.access()), manual.access);
  if (manual.note.starts_with("no range printed")) {
    EXPECT_TRUE(parameter.minimum() >= manual.minimum && parameter.maximum() <= manual.maximum);
  } else {
    EXPECT_EQ(parameter.minimum(), manual.minimum);
    EXPECT_EQ(parameter.maximum(), manual.maximum);
  }
  EXPECT_EQ(type_name(parameter.type()), manual.type);
  EXPECT_EQ(parameter.has_default_value(), manual.default_value.has_value());
  if (manual.default_value) EXPECT_EQ(parameter.default_value(), *manual.default_value);
  EXPECT_EQ(parameter.unit(), manual.unit);
  EXPECT_FALSE(parameter.description().empty());
  EXPECT_EQ(parameter.instead().empty(), manual.access != "WO") << parameter.instead();
}

std::string every_parameter(const Setup& setup) {
  Bench bench(setup);
  const auto all = list(bench);
  std::set<std::string> names;
  std::set<std::uint32_t> addresses;
  for (const auto& parameter : all.parameters()) {
    EXPECT_TRUE(names.insert(parameter.name()).second) << parameter.name();
    EXPECT_TRUE(addresses.insert(parameter.address()).second) << parameter.name();
    if (const auto* manual = setup.manual.find(parameter.address()))
      compare(parameter, *manual);
    else
      ADD_FAILURE() << parameter.name() << " is not in the manual";
  }
  EXPECT_EQ(addresses.size(), setup.manual.parameters().size());

  const auto answer = read(bench, {});
  if (!answer.ok()) throw Broken("ReadParameters: " + answer.status.error_message());
  std::set<std::uint32_t> found;
  for (const auto& value : answer->values()) {
    found.insert(value.address());
    const auto parameter =
        std::ranges::find(all.parameters(), value.address(), [](const auto& one) { return one.address(); });
    const auto* manual = setup.manual.find(value.address());
    if (parameter == all.parameters().end() || manual == nullptr)
      throw Broken("read, but not listed: " + value.ShortDebugString());
    // Some defaults of the manual cannot be written back (YKD2405PR 0x00C0: 30 to 2000, default 0).
    if (!parameter->has_default_value() || value.value() != parameter->default_value()) {
      EXPECT_GE(value.value(), parameter->minimum()) << parameter->name();
      EXPECT_LE(value.value(), parameter->maximum()) << parameter->name();
    }
    // A measured value is another one a few milliseconds later.
    constexpr std::string_view measures[] = {"Present position", "Present speed", "Actual position",
                                             " actual", "Following error"};
    const bool measured =
        setup.manual.says_yes("closed_loop") &&
        std::ranges::any_of(measures, [&](auto name) { return manual->title.contains(name); });
    if (!measured)
      EXPECT_EQ(value.value() & manual->mask(),
                std::stoll(bench.outside(fmt::format("peek @1 {}", value.address()))))
          << parameter->name();
    const bool free = parameter->configured_by().empty() && !is_for_motion(setup.manual, value.address()) &&
                      parameter->access() != v1::PARAMETER_ACCESS_READ_ONLY;
    if (free && parameter->has_default_value())
      EXPECT_EQ(value.value(), parameter->default_value()) << parameter->name() << ": nobody has changed it";
  }
  for (const auto& manual : setup.manual.parameters())
    EXPECT_EQ(found.contains(manual.address), manual.access != "WO")
        << fmt::format("0x{:04X}", manual.address);
  bench.finish(0);
  return std::to_string(addresses.size());
}

/// Settings that neither move nor address anything, with another value than they have.
Values some_changes(const Manual& manual, const v1::ListParametersResponse& all) {
  const auto [first, last] = manual.range("free_settings");
  Values values;
  for (const auto& one : all.parameters())
    if ((one.access() == v1::PARAMETER_ACCESS_READ_WRITE ||
         one.access() == v1::PARAMETER_ACCESS_READ_WRITE_SAVED) &&
        one.configured_by().empty() && one.address() >= first && one.address() <= last &&
        one.has_default_value() && one.maximum() - one.minimum() > 100 && values.size() < 12)
      values.emplace_back(one.name(), one.default_value() < one.maximum() ? one.default_value() + 1
                                                                          : one.default_value() - 1);
  return values;
}

std::string writing(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  const auto values = some_changes(setup.manual, list(bench));
  if (values.size() < 3) throw Broken("nothing to write");
  EXPECT_FALSE(write(bench, values).ok()) << "written while enabled";
  expect_done(bench.client.disable());
  const auto written = write(bench, values);
  if (!written.ok()) throw Broken("WriteParameters: " + written.status.error_message());
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  const auto back = read(bench, names);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(written->values(static_cast<int>(i)).value(), values[i].second) << names[i];
    EXPECT_EQ(back->values(static_cast<int>(i)).value(), values[i].second) << names[i];
  }
  bench.finish(0);
  return "yes";
}

std::string refusals(const Setup& setup) {
  Bench bench(setup);
  expect_done(bench.client.disable());
  const auto all = list(bench);
  const auto free = some_changes(setup.manual, all).front();
  const auto untouched = read(bench, {free.first})->values(0).value();
  for (const auto& one : all.parameters()) {
    SCOPED_TRACE(one.name());
    // With one that could be written: all or none.
    const auto refused = [&](std::int64_t value, v1::Reason reason) {
      const bool same = one.name() == free.first;
      return expect_refused(
          write(bench, same ? Values{{one.name(), value}} : Values{free, {one.name(), value}}), reason);
    };
    if (one.access() == v1::PARAMETER_ACCESS_WRITE_ONLY) {
      const auto error = refused(1, v1::REASON_INVALID_ARGUMENT);
      EXPECT_NE((error.message() + error.remedy()).find(one.instead()), std::string::npos) << error.remedy();
      expect_refused(read(bench, {one.name()}), v1::REASON_INVALID_ARGUMENT);
    } else if (one.access() == v1::PARAMETER_ACCESS_READ_ONLY) {
      refused(one.minimum(), v1::REASON_INVALID_ARGUMENT);
    } else {
      const auto error = refused(one.maximum() + 1, v1::REASON_OUT_OF_RANGE);
      EXPECT_EQ(error.permitted().maximum(), static_cast<double>(one.maximum()));
      refused(one.minimum() - 1, v1::REASON_OUT_OF_RANGE);
      if (one.configured_by().empty()) continue;
      const auto owned = refused(one.minimum(), v1::REASON_INVALID_ARGUMENT);
      EXPECT_NE((owned.message() + owned.remedy()).find(one.configured_by()), std::string::npos)
          << owned.message();
    }
  }
  expect_refused(write(bench, {{"no_such_parameter", 1}}), v1::REASON_INVALID_ARGUMENT);
  expect_refused(read(bench, {"no_such_parameter"}), v1::REASON_INVALID_ARGUMENT);
  EXPECT_EQ(read(bench, {free.first})->values(0).value(), untouched) << "part of a refused batch was written";
  bench.finish(0);
  return "refused";
}

std::string save_and_restore(const Setup& setup) {
  Bench bench(setup);
  bench.ready();
  v1::SaveParametersRequest save;
  save.set_axis("axis");
  v1::RestoreFactoryRequest restore;
  restore.set_axis("axis");
  expect_refused(bench.client.call(&v1::DriveService::Stub::SaveParameters, save),
                 v1::REASON_INVALID_ARGUMENT);
  expect_refused(bench.client.call(&v1::DriveService::Stub::RestoreFactory, restore),
                 v1::REASON_INVALID_ARGUMENT);
  save.set_confirm("axis");
  restore.set_confirm("axis");
  EXPECT_FALSE(bench.client.call(&v1::DriveService::Stub::SaveParameters, save).ok()) << "while enabled";
  EXPECT_FALSE(bench.client.call(&v1::DriveService::Stub::RestoreFactory, restore).ok()) << "while enabled";
  expect_done(bench.client.disable());

  const auto change = some_changes(setup.manual, list(bench)).front();
  if (const auto written = write(bench, {change}); !written.ok())
    throw Broken("WriteParameters: " + written.status.error_message());
  const auto before = bench.eeprom_writes();
  const auto saved = bench.client.call(&v1::DriveService::Stub::SaveParameters, save);
  EXPECT_TRUE(saved.ok()) << saved.status.error_message();
  EXPECT_GT(bench.eeprom_writes(), before);
  bench.cycle_power();
  bench.pass(2s);
  bench.await_online();
  EXPECT_EQ(read(bench, {change.first})->values(0).value(), change.second) << "saved, but lost";

  expect_done(bench.client.disable());
  const auto restored = bench.client.call(&v1::DriveService::Stub::RestoreFactory, restore);
  EXPECT_TRUE(restored.ok()) << restored.status.error_message();
  EXPECT_FALSE(restored->after_power_cycle().empty());
  // CiA 301 7.5.2.14: the defaults hold from the next reset.
  if (setup.manual.has("restore_counts_from")) bench.cycle_power();
  bench.pass(2s);
  const auto state = bench.await_online();  // configured again
  EXPECT_EQ(state.trust(), v1::POSITION_TRUST_UNKNOWN);
  EXPECT_NE(read(bench, {change.first})->values(0).value(), change.second);
  bench.enable();
  expect_done(bench.client.home());
  bench.finish(1);
  return "yes";
}

/// Of the homing methods that the YAML may name by their number.
std::vector<std::int64_t> numbers_of(const Manual& manual) {
  if (!manual.has("homing_numbers")) return {};
  const auto [first, last] = manual.range("homing_numbers");
  std::vector<std::int64_t> numbers;
  for (auto number = first; number <= last; ++number)
    if (number != 0) numbers.push_back(number);
  return numbers;
}

/// What the API says of the model is what its manual says.
std::string description(const Setup& setup) {
  Bench bench(setup);
  v1::GetDriveRequest request;
  request.set_axis("axis");
  const auto answer = bench.client.call(&v1::DriveService::Stub::GetDrive, request);
  if (!answer.ok()) throw Broken("GetDrive: " + answer.status.error_message());
  const auto& drive = answer.response;
  const auto& manual = setup.manual;
  EXPECT_EQ(drive.model(), manual.model());
  EXPECT_EQ(drive.closed_loop(), manual.says_yes("closed_loop"));
  EXPECT_EQ(drive.maximum_rpm(), manual.number("max_rpm"));
  EXPECT_EQ(drive.maximum_pulse_rate_hz(), manual.number("pulse_rate_hz"));
  EXPECT_EQ(drive.maximum_segments(), manual.number("pt_segments"));
  const auto numbers = numbers_of(manual);
  EXPECT_EQ(static_cast<std::size_t>(drive.homing_methods_size()),
            manual.list("homing_modes").size() + numbers.size());
  for (const auto number : numbers)
    EXPECT_EQ(std::ranges::count(drive.homing_methods(), std::to_string(number)), 1) << number;
  EXPECT_FALSE(drive.communication_watchdog());
  EXPECT_FALSE(drive.version().empty());
  bool known_code = false;
  for (const auto& code : manual.list("model_codes"))
    known_code = known_code || std::stoul(code, nullptr, 0) == drive.model_code();
  EXPECT_TRUE(known_code) << drive.model_code();

  std::set<std::int64_t> microsteps, expected_microsteps;
  for (const auto pulses : drive.pulses_per_revolution()) microsteps.insert(pulses);
  for (const auto& text : manual.list("microsteps")) expected_microsteps.insert(std::stoll(text));
  EXPECT_EQ(microsteps, expected_microsteps);
  std::set<std::int64_t> bauds, expected_bauds;
  for (const auto baud : drive.bauds()) bauds.insert(baud);
  for (const auto& key : {"bauds_custom", "bauds_dip"})
    for (const auto& text : manual.list(key)) expected_bauds.insert(std::stoll(text));
  EXPECT_EQ(bauds, expected_bauds);

  std::map<int, std::string> alarms;
  for (const auto& alarm : drive.alarms()) {
    EXPECT_FALSE(alarm.remedy().empty());
    alarms[static_cast<int>(alarm.code())] = alarm.reset() == v1::ALARM_RESET_POWER_CYCLE ? "power_cycle"
                                             : alarm.reset() == v1::ALARM_RESET_BY_ITSELF ? "by_itself"
                                                                                          : "by_command";
  }
  EXPECT_EQ(alarms, manual.alarms());

  const auto compare_terminals = [&](const auto& terminals, const std::string& names,
                                     const std::string& functions) {
    std::vector<std::string> found, expected;
    for (const auto& [code, name] : manual.functions(functions)) expected.push_back(name);
    for (const auto& terminal : terminals) {
      found.push_back(terminal.name());
      const std::vector<std::string> named(terminal.functions().begin(), terminal.functions().end());
      auto possible = expected;
      if (const auto only = "only_function." + terminal.name(); manual.has(only))
        std::erase_if(possible, [&](const std::string& function) {
          return function != manual.text(only) && function != function_of_drive(manual.text(only), true);
        });
      EXPECT_EQ(named, possible) << terminal.name();
    }
    EXPECT_EQ(found, manual.list(names));
  };
  compare_terminals(drive.inputs(), "inputs", "input_function");
  compare_terminals(drive.outputs(), "outputs", "output_function");
  bench.finish(0);
  return "yes";
}

constexpr Scenario scenarios[] = {
    {"every_parameter", "parameters by name, as the manual's table has them", &every_parameter},
    {"writing", "parameters written in a batch, verified", &writing},
    {"refusals", "bad parameters", &refusals},
    {"save_and_restore", "save parameters, restore the factory settings", &save_and_restore},
    {"description", "terminals, functions, alarms, microsteps as in the manual", &description},
};

}  // namespace

std::span<const Scenario> parameter_scenarios() { return scenarios; }

}  // namespace axisd::conformance
