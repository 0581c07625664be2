#include "api/cell/stop_all_keeper.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <set>
#include <utility>

#include "api/cell/gather.hpp"
#include "api/cell/kept_file.hpp"
#include "api/cell/status.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

/// An answer comes within a second, so what is waited for comes before.
constexpr Duration machine_patience = std::chrono::milliseconds(900);
constexpr Duration answer_patience = std::chrono::milliseconds(950);
constexpr Duration exchange_patience = std::chrono::milliseconds(800);
constexpr Duration release_patience = std::chrono::seconds(2);
constexpr Duration spread_period = std::chrono::seconds(10);
/// Answers come in at once. What is not on the disk yet of who was told is told once more after a restart.
constexpr Duration told_period = std::chrono::milliseconds(100);

bool is_silent(const grpc::Status& status) {
  return status.error_details().empty() && (status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                                            status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED);
}

v1::MachineOutcome outcome_of(const grpc::Status& status) {
  return status.ok()         ? v1::MACHINE_OUTCOME_DONE
         : is_silent(status) ? v1::MACHINE_OUTCOME_SILENT
                             : v1::MACHINE_OUTCOME_FAILED;
}

axisd::v1::ErrorDetail pending(std::string_view what) {
  return detail_of(axisd::v1::REASON_STORAGE, fmt::format("{} has not confirmed it yet", what),
                   "it goes on; GetCell tells what came of it");
}

/// "by anna at press-1: why", for a line of the log.
std::string text_of(const v1::StopAllLatch& latch) {
  return fmt::format("by {} at {}{}{}", latch.by(), latch.entrance(), latch.reason().empty() ? "" : ": ",
                     config::printable(latch.reason(), 256));
}

}  // namespace

/// One StopAll that is being answered.
struct StopAllKeeper::Stopping {
  v1::StopAllResponse response;
  std::shared_ptr<Gather> gather;
};
struct StopAllKeeper::Releasing {
  v1::ReleaseStopAllResponse response;
  std::shared_ptr<Gather> gather;
  Metadata metadata;
  Released done;
};

StopAllKeeper::StopAllKeeper(Parts parts)
    : parts_(std::move(parts)), path_(parts_.settings.state + "/stop_all") {
  const auto read = read_kept(path_);
  kept::StopAllRecord record;
  if (!read) {
    not_durable_ = read.error();
    spdlog::error("{}", to_string(read.error()));
  } else if (*read && record.ParseFromString(**read)) {
    machine_.restore(record);
  }
  for (const auto& latch : machine_.standing())
    spdlog::warn("StopAll of the cell stands, {}", text_of(latch));
  spread_now_and_then();
}

void StopAllKeeper::announce(v1::CellEventKind kind, const v1::StopAllLatch& latch, std::string text) {
  spdlog::warn("{}", text);
  v1::CellEvent event;
  event.set_kind(kind);
  *event.mutable_stop_all() = latch;
  event.set_text(std::move(text));
  parts_.tell(std::move(event));
}

void StopAllKeeper::stop(const Caller& caller, const std::string& reason, Stopped done) {
  v1::StopAllLatch latch;
  latch.set_id(fmt::format("{}-{}", parts_.instance_id, ++last_id_));
  latch.set_by(caller.name.substr(0, 128));
  latch.set_reason(reason.size() <= 256 ? config::printable(reason, 256) : std::string());
  latch.set_entrance(parts_.settings.machine);
  set_time(*latch.mutable_at(), parts_.clock.wall(parts_.clock.now()));
  latch = machine_.stop(std::move(latch));

  const auto stopping = std::make_shared<Stopping>();
  *stopping->response.mutable_latch() = latch;
  stopping->gather = Gather::begin(parts_.clock, answer_patience, [stopping, done = std::move(done)] {
    done(stopping->response);
    stopping->gather.reset();
  });
  // First the machines: nothing else is waited for.
  const auto metadata = Callers::metadata_for(caller).value_or(Metadata());
  for (const auto& [name, entry] : parts_.machines.roster().entries()) tell_machine(name, stopping, metadata);
  announce(v1::CELL_EVENT_KIND_STOP_ALL, latch, fmt::format("StopAll of the cell {}", text_of(latch)));
  keep(*stopping, stopping);
  spread([] {});
  stopping->gather->seal();
}

template <class Answer>
void StopAllKeeper::keep(Answer& answer, const std::shared_ptr<Answer>& alive) {
  answer.gather->add();
  *answer.response.mutable_not_durable() = pending("the disk");
  save([alive, gather = answer.gather](std::optional<axisd::v1::ErrorDetail> error) {
    alive->response.clear_not_durable();
    if (error) *alive->response.mutable_not_durable() = *std::move(error);
    gather->come();
  });
  if (parts_.registry == nullptr) return;
  answer.gather->add();
  *answer.response.mutable_not_shared() = pending("etcd");
  share([alive, gather = answer.gather](std::optional<axisd::v1::ErrorDetail> error) {
    alive->response.clear_not_shared();
    if (error) *alive->response.mutable_not_shared() = *std::move(error);
    gather->come();
  });
}

void StopAllKeeper::tell_machine(const std::string& name, const std::shared_ptr<Stopping>& stopping,
                                 const Metadata& metadata) {
  const int index = stopping->response.machines_size();
  auto& pending_result = *stopping->response.add_machines();
  pending_result.set_machine(name);
  pending_result.set_outcome(v1::MACHINE_OUTCOME_SILENT);
  *pending_result.mutable_error() =
      detail_of(axisd::v1::REASON_OFFLINE, fmt::format("{} has not answered in time", name),
                "it is told again when it comes back; look at the machine");
  auto* const link = parts_.machines.link(name);
  if (link == nullptr) return;
  const auto gather = stopping->gather;
  gather->add();
  machine_.telling(name);
  const auto& peer = parts_.machines.roster().entries().find(name)->second.peer;
  const auto instance = peer.answers() ? peer.last()->instance_id : std::string();
  const auto asked_at = parts_.clock.now();
  link->stop_all(metadata, machine_patience,
                 [this, name, index, stopping, gather, instance, asked_at](
                     const grpc::Status& status, const axisd::v1::StopAllResponse& response) {
                   auto& result = *stopping->response.mutable_machines(index);
                   result.set_outcome(outcome_of(status));
                   set_duration(*result.mutable_took(), parts_.clock.now() - asked_at);
                   if (status.ok() && instance.empty()) {
                     // Somebody was stopped. Whether it is this machine is not known yet.
                     result.set_outcome(v1::MACHINE_OUTCOME_FAILED);
                     machine_.not_told(name);
                   } else if (status.ok()) {
                     result.clear_error();
                     *result.mutable_response() = response;
                     if (machine_.told(name, instance)) save_soon();
                   } else {
                     auto error = detail_of(status);
                     error.set_message(fmt::format("{}: {}", name, error.message()));
                     if (is_silent(status)) error.set_remedy(result.error().remedy());
                     *result.mutable_error() = std::move(error);
                     machine_.not_told(name);
                   }
                   gather->come();
                 });
}

void StopAllKeeper::seen(const std::string& machine, const PeerAnswer& answer) {
  if (machine_.seen(machine, answer.instance_id, answer.inhibited)) tell_again(machine, answer.instance_id);
}

void StopAllKeeper::tell_again(const std::string& name, const std::string& instance_id) {
  auto* const link = parts_.machines.link(name);
  if (link == nullptr) return machine_.not_told(name);
  link->stop_all(
      {}, machine_patience,
      [this, name, instance_id](const grpc::Status& status, const axisd::v1::StopAllResponse&) {
        if (!status.ok()) return machine_.not_told(name);
        if (!machine_.told(name, instance_id)) return;
        ++told_again_;
        save_soon();
        v1::CellEvent event;
        event.set_kind(v1::CELL_EVENT_KIND_STOP_ALL_TOLD);
        event.set_machine(name);
        event.set_text(fmt::format("{} has come back, and was stopped: StopAll of the cell stands", name));
        spdlog::warn("{}", event.text());
        parts_.tell(std::move(event));
      });
}

void StopAllKeeper::release(const Caller& caller, Released done) {
  google::protobuf::Timestamp now;
  set_time(now, parts_.clock.wall(parts_.clock.now()));
  const auto released = machine_.release(caller.name.substr(0, 128), now);
  const auto releasing = std::make_shared<Releasing>();
  releasing->metadata = Callers::metadata_for(caller).value_or(Metadata());
  releasing->done = std::move(done);
  for (const auto& latch : released) {
    *releasing->response.add_released() = latch;
    announce(v1::CELL_EVENT_KIND_STOP_ALL_RELEASED, latch,
             fmt::format("StopAll of the cell by {} was released by {}", latch.by(), latch.released_by()));
  }
  // An entrance that has not heard of it would stop a machine again that is released before.
  releasing->gather = Gather::begin(parts_.clock, answer_patience, [this, releasing] {
    releasing->gather.reset();
    release_machines(releasing);
  });
  keep(*releasing, releasing);
  releasing->gather->add();
  spread([gather = releasing->gather] { gather->come(); });
  releasing->gather->seal();
}

void StopAllKeeper::release_machines(const std::shared_ptr<Releasing>& releasing) {
  releasing->gather = Gather::begin(parts_.clock, release_patience, [releasing] {
    releasing->gather.reset();
    std::exchange(releasing->done, {})(releasing->response);
  });
  for (const auto& [name, entry] : parts_.machines.roster().entries()) {
    const int index = releasing->response.machines_size();
    auto& waiting = *releasing->response.add_machines();
    waiting.set_machine(name);
    waiting.set_outcome(v1::MACHINE_OUTCOME_SILENT);
    *waiting.mutable_error() = detail_of(axisd::v1::REASON_OFFLINE, fmt::format("{} has not answered", name),
                                         "when it has come back, release it by itself");
    auto* const link = parts_.machines.link(name);
    if (link == nullptr || !entry.peer.is_open()) continue;
    releasing->gather->add();
    link->release_stop_all(releasing->metadata, release_patience,
                           [index, releasing, gather = releasing->gather](const grpc::Status& status) {
                             auto& result = *releasing->response.mutable_machines(index);
                             result.set_outcome(outcome_of(status));
                             result.clear_error();
                             if (!status.ok()) *result.mutable_error() = detail_of(status);
                             gather->come();
                           });
  }
  releasing->gather->seal();
}

void StopAllKeeper::save(Done done) {
  parts_.disk.write(path_, machine_.record_with_told().SerializeAsString(),
                    [this, done = std::move(done)](const Result<void>& written) {
                      not_durable_ = written ? std::nullopt : std::optional(written.error());
                      if (!written) spdlog::error("{}", to_string(written.error()));
                      done(written ? std::nullopt : std::optional(detail_of(written.error())));
                    });
}

void StopAllKeeper::save_soon() {
  if (std::exchange(to_save_, true)) return;
  saving_ = parts_.clock.call_at(parts_.clock.now() + told_period, [this] {
    to_save_ = false;
    save([](const auto&) {});
  });
}

void StopAllKeeper::share(Done done, int attempts) {
  if (parts_.registry == nullptr) return done(std::nullopt);
  auto value = machine_.record().SerializeAsString();
  if (value == key_.value) return done(std::nullopt);
  parts_.registry->client().replace_stop_all(
      std::move(value), key_.revision,
      [this, done = std::move(done), attempts](const etcd::Client::Replaced& replaced) {
        if (replaced.other) {
          take_in(merge(*replaced.other));
          if (attempts > 1) return share(done, attempts - 1);
        }
        if (!replaced.other && replaced.error.empty()) return done(std::nullopt);
        done(detail_of(axisd::v1::REASON_STORAGE,
                       replaced.error.empty() ? "etcd: others keep changing it" : "etcd: " + replaced.error,
                       "it is written as soon as etcd answers; entrances tell each other meanwhile"));
      });
}

StopAllMachine::Merged StopAllKeeper::merge(const etcd::Versioned& key) {
  key_ = key;
  kept::StopAllRecord record;
  if (!record.ParseFromString(key.value)) {
    spdlog::error("what etcd has of StopAll cannot be read, and is replaced");
    record.Clear();
  }
  return machine_.merge(record.latches());
}

void StopAllKeeper::read(const etcd::Versioned& key) {
  const auto merged = merge(key);
  take_in(merged);
  if (merged.other_lacks) share([](const auto&) {});
}

v1::ExchangeStopAllResponse StopAllKeeper::exchange(const v1::ExchangeStopAllRequest& request) {
  const auto merged = machine_.merge(request.latches());
  take_in(merged);
  const std::set<std::string> reached(request.reached().begin(), request.reached().end());
  tell_if([&](const std::string& name) { return !reached.contains(name); });
  if (merged.changed()) share([](const auto&) {});
  v1::ExchangeStopAllResponse response;
  *response.mutable_latches() = machine_.record().latches();
  return response;
}

void StopAllKeeper::take_in(const StopAllMachine::Merged& merged) {
  if (!merged.changed()) return;
  for (const auto& latch : merged.began)
    announce(v1::CELL_EVENT_KIND_STOP_ALL, latch, fmt::format("StopAll of the cell {}", text_of(latch)));
  for (const auto& latch : merged.ended)
    announce(v1::CELL_EVENT_KIND_STOP_ALL_RELEASED, latch,
             fmt::format("StopAll of the cell by {} was released by {}", latch.by(), latch.released_by()));
  save([](const auto&) {});
  if (!merged.began.empty())
    tell_if([&](const std::string& name) { return name == parts_.settings.machine; });
}

/// Whoever was asked tells all machines that it reaches. Where all entrances did so at once, a cell of 100
/// machines would send 10,000 of them. Whoever is not told here is asked within a second, and told where
/// nothing holds it by then.
void StopAllKeeper::tell_if(const std::function<bool(const std::string&)>& wanted) {
  for (const auto& [name, entry] : parts_.machines.roster().entries())
    if (entry.peer.answers() && wanted(name)) seen(name, *entry.peer.last());
}

void StopAllKeeper::spread(std::function<void()> done) {
  v1::ExchangeStopAllRequest request;
  request.set_cell(parts_.settings.cell);
  *request.mutable_latches() = machine_.record().latches();
  for (const auto& [name, entry] : parts_.machines.roster().entries())
    if (entry.peer.is_open()) request.add_reached(name);
  const auto gather = Gather::begin(parts_.clock, exchange_patience, std::move(done));
  for (const auto& [name, entry] : parts_.machines.roster().entries()) {
    auto* const link = parts_.machines.link(name);
    if (link == nullptr || link->addresses().cell.empty()) continue;
    gather->add();
    link->exchange(request, exchange_patience,
                   [this, gather](const grpc::Status& status, const v1::ExchangeStopAllResponse& response) {
                     if (status.ok()) {
                       const auto merged = machine_.merge(response.latches());
                       take_in(merged);
                       if (merged.changed()) share([](const auto&) {});
                     }
                     gather->come();
                   });
  }
  gather->seal();
}

void StopAllKeeper::spread_now_and_then() {
  spreading_ = parts_.clock.call_at(parts_.clock.now() + spread_period, [this] { spread_now_and_then(); });
  if (machine_.record().latches_size() > 0) spread([] {});
}

}  // namespace axisd::cell
