// Another address, baud rate or format for a drive: explicit, confirmed, verified after a power cycle.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// A drive whose address and rate are custom: its switches are all off, or it has none. Its rate is then that
/// of the first code.
Recipe custom_recipe(const Manual& manual) {
  Recipe recipe{.node = static_cast<int>(manual.range("nodes_custom").first) + 1};
  recipe.drive = "dip=0";
  if (!manual.list("bauds_dip").empty()) recipe.drive += ",dip_baud=custom";
  recipe.baud = std::stoi(manual.list("bauds_custom").front());
  return recipe;
}

/// A serial service, phase by phase; `between` lets something happen after the first.
template <class Response, class Request, class Stub, class Between>
std::vector<v1::SerialPhase> follow(
    Bench& bench,
    std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*, const Request&),
    const Request& request, grpc::Status& status, Between between) {
  grpc::ClientContext context;
  Client::set_deadline(context);
  Stub stub(bench.target->channel());
  auto reader = (stub.*method)(&context, request);
  std::vector<v1::SerialPhase> phases;
  for (Response response; reader->Read(&response);) {
    EXPECT_FALSE(response.text().empty());
    if (phases.empty()) {
      EXPECT_NE(response.text().find("power-up"), std::string::npos)
          << "it does not say that a power cycle is needed: " << response.text();
      between();
    }
    phases.push_back(response.phase());
  }
  status = reader->Finish();
  return phases;
}

void power_cycle(Bench& bench) {
  bench.cycle_power(2s);
  bench.pass(20s);
}

std::string readdress(const Setup& setup) {
  const auto recipe = custom_recipe(setup.manual);
  Bench bench(setup, recipe);
  bench.ready();
  v1::ReaddressRequest request;
  request.set_axis("axis");
  request.set_node(static_cast<std::uint32_t>(recipe.node + 3));
  to_proto(60s, *request.mutable_verify());
  grpc::Status status;
  const auto attempt = [&](auto between) {
    return follow<v1::ReaddressResponse>(bench, &v1::DriveService::Stub::Readdress, request, status, between);
  };
  EXPECT_TRUE(attempt([] {}).empty());
  expect_refused(status, Client::detail_of(status), v1::REASON_INVALID_ARGUMENT);  // not confirmed
  request.set_confirm("axis");
  EXPECT_TRUE(attempt([] {}).empty()) << "while enabled";
  EXPECT_FALSE(status.ok());
  expect_done(bench.client.disable());
  request.set_node(200);
  EXPECT_TRUE(attempt([] {}).empty());
  expect_refused(status, Client::detail_of(status), v1::REASON_OUT_OF_RANGE);

  request.set_node(static_cast<std::uint32_t>(recipe.node + 3));
  const auto phases = attempt([&] { power_cycle(bench); });
  EXPECT_TRUE(status.ok()) << status.error_message();
  if (phases.empty()) throw Broken("Readdress: no phase");
  EXPECT_EQ(phases.front(), v1::SERIAL_PHASE_WRITTEN);
  EXPECT_EQ(phases.back(), v1::SERIAL_PHASE_VERIFIED) << status.error_message();
  // It answers at its new address, and no longer at the one of the configuration.
  bench.outside(fmt::format("shaft {}", recipe.node + 3));
  bench.await([](const auto& s) { return s.link() == v1::LINK_STATE_OFFLINE; }, "offline at its old address");
  bench.finish(0);
  return setup.manual.text("nodes_custom");
}

v1::SetSerialRequest serial_request(std::uint32_t baud, const std::string& format) {
  v1::SetSerialRequest request;
  request.set_axis("axis");
  request.set_confirm("axis");
  if (baud != 0) request.set_baud(baud);
  request.set_format(format);
  to_proto(60s, *request.mutable_verify());
  return request;
}

/// On a line whose settings the daemon can follow.
void set_and_verify(const Setup& setup, const v1::SetSerialRequest& request) {
  Bench bench(setup, custom_recipe(setup.manual));
  expect_done(bench.client.disable());
  grpc::Status status;
  const auto phases = follow<v1::SetSerialResponse>(bench, &v1::DriveService::Stub::SetSerial, request,
                                                    status, [&] { power_cycle(bench); });
  EXPECT_TRUE(status.ok()) << status.error_message();
  if (phases.empty()) throw Broken("SetSerial: no phase");
  EXPECT_EQ(phases.front(), v1::SERIAL_PHASE_WRITTEN);
  EXPECT_EQ(phases.back(), v1::SERIAL_PHASE_VERIFIED) << status.error_message();
  bench.await([](const auto& s) { return s.link() == v1::LINK_STATE_OFFLINE; }, "deaf to its old settings");
  bench.finish(0);
}

/// On a network whose rate is not the daemon's to change, and which knows no formats.
void set_unverified(const Setup& setup, v1::SetSerialRequest request) {
  Bench bench(setup, custom_recipe(setup.manual));
  expect_done(bench.client.disable());
  grpc::Status status;
  const auto attempt = [&](auto between) {
    return follow<v1::SetSerialResponse>(bench, &v1::DriveService::Stub::SetSerial, request, status, between);
  };
  EXPECT_TRUE(attempt([] {}).empty()) << "verified at a rate that the network does not have?";
  EXPECT_FALSE(status.ok());
  request.clear_verify();
  auto formatted = serial_request(0, "8E1");
  formatted.clear_verify();
  std::swap(request, formatted);
  EXPECT_TRUE(attempt([] {}).empty()) << "it has no format";
  EXPECT_FALSE(status.ok());
  std::swap(request, formatted);
  const auto phases = attempt([] {});
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(phases, std::vector{v1::SERIAL_PHASE_WRITTEN});
  EXPECT_NE(bench.state().link(), v1::LINK_STATE_OFFLINE) << "it counts from the next power-up";
  power_cycle(bench);
  bench.await([](const auto& s) { return s.link() == v1::LINK_STATE_OFFLINE; }, "deaf to its old settings");
  bench.finish(0);
}

std::string set_serial(const Setup& setup) {
  const auto baud = static_cast<std::uint32_t>(std::stoi(setup.manual.list("bauds_custom")[1]));
  if (setup.manual.list("formats").empty()) {
    set_unverified(setup, serial_request(baud, ""));
  } else {
    for (const auto& request : {serial_request(baud, ""), serial_request(0, "8E1")}) {
      SCOPED_TRACE(request.ShortDebugString());
      set_and_verify(setup, request);
    }
  }
  return setup.manual.text("bauds_custom");
}

/// The address and rate of such a drive are for its switches, or its maker's tool.
template <class Response, class Request, class Stub>
void expect_nothing_set(const Setup& setup,
                        std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                                      const Request&),
                        Request request) {
  request.set_axis("axis");
  request.set_confirm("axis");
  Bench bench(setup);
  expect_done(bench.client.disable());
  grpc::Status status;
  EXPECT_TRUE(follow<Response>(bench, method, request, status, [] {}).empty());
  expect_refused(status, Client::detail_of(status), v1::REASON_NOT_SUPPORTED);
  power_cycle(bench);
  bench.await_online();
  bench.finish(0);
}

std::string no_readdress(const Setup& setup) {
  v1::ReaddressRequest request;
  request.set_node(9);
  expect_nothing_set(setup, &v1::DriveService::Stub::Readdress, request);
  return "no";
}

std::string no_set_serial(const Setup& setup) {
  v1::SetSerialRequest request;
  request.set_baud(static_cast<std::uint32_t>(std::stoi(setup.manual.list("bauds_dip").back())));
  expect_nothing_set(setup, &v1::DriveService::Stub::SetSerial, request);
  return "no";
}

constexpr Scenario scenarios[] = {
    {"readdress", "address changed and verified", &readdress, &no_readdress},
    {"set_serial", "baud rate (and format) changed, verified where the daemon can follow", &set_serial,
     &no_set_serial},
};

}  // namespace

std::span<const Scenario> serial_scenarios() { return scenarios; }

}  // namespace axisd::conformance
