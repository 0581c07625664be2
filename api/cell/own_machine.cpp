#include "api/cell/own_machine.hpp"

#include <fmt/format.h>

#include <utility>

#include "api/cell/ask.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "buses/limited_log.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

constexpr Duration period = std::chrono::seconds(5), patience = std::chrono::seconds(2);

}  // namespace

OwnMachine::OwnMachine(boost::asio::any_io_executor core, Clock& clock, const Settings& settings,
                       std::string machine_id, Machines& machines,
                       std::function<void(const kept::Registration&)> changed)
    : core_(std::move(core)),
      clock_(clock),
      settings_(settings),
      machine_id_(std::move(machine_id)),
      machines_(machines),
      changed_(std::move(changed)) {}

void OwnMachine::look() {
  timer_ = clock_.call_at(clock_.now() + period, [this] { look(); });
  const auto* entry = &machines_.roster().entries().find(settings_.machine)->second;
  if (!entry->peer.is_open()) return;
  instance_id_ = entry->peer.last()->instance_id;
  const auto channel = machines_.link(settings_.machine)->way().main;
  ask<axisd::v1::ListAxesResponse>(
      core_, channel, {.path = "/axisd.v1.AxisService/ListAxes", .timeout = patience, .metadata = {}},
      axisd::v1::ListAxesRequest(),
      [this](const grpc::Status& status, const axisd::v1::ListAxesResponse& response) {
        if (!status.ok())
          log_limited(spdlog::level::warn, "own axisd", "axes",
                      fmt::format("the axisd of this machine does not tell its axes: {}",
                                  config::printable(status.error_message(), 200)));
        if (status.ok()) registration_.clear_axes();
        for (const auto& axis : response.axes()) registration_.add_axes(axis.axis());
        offer();
      });
  ask<axisd::v1::GetConfigResponse>(
      core_, channel, {.path = "/axisd.v1.SystemService/GetConfig", .timeout = patience, .metadata = {}},
      axisd::v1::GetConfigRequest(),
      [this](const grpc::Status& status, const axisd::v1::GetConfigResponse& response) {
        if (!status.ok()) return;
        registration_.set_configuration_revision(response.revision());
        offer();
      });
}

void OwnMachine::offer() {
  const auto& entry = machines_.roster().entries().find(settings_.machine)->second;
  if (!entry.peer.last()) return;
  registration_.set_name(settings_.machine);
  registration_.set_machine_id(machine_id_);
  registration_.set_cell_address(settings_.advertise);
  registration_.set_axisd_address(entry.registration.axisd_address());
  registration_.set_stop_address(entry.registration.stop_address());
  registration_.set_version(entry.peer.last()->version);
  machines_.set_own(registration_);
  changed_(registration_);
}

}  // namespace axisd::cell
