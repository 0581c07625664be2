#include "api/axisctl/machine_streams.hpp"

#include <chrono>
#include <utility>

#include "api/axisctl/interrupt.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

/// Before a machine that was lost is asked again: the entrance answers at once for one that is silent.
constexpr std::chrono::milliseconds pause(500);

}  // namespace

MachineStreams::MachineStreams(Invocation& invocation, const Selection& selection, Read read, Tell tell)
    : invocation_(invocation), selection_(selection), read_(std::move(read)), tell_(std::move(tell)) {}

MachineStreams::~MachineStreams() {
  end();
  for (auto& [name, machine] : open_) machine.thread.join();
}

void MachineStreams::run() {
  const Interrupt interrupt([this] { end(); });
  const auto known = machines_of_cell(invocation_);
  const auto names = selected(known, selection_);
  tell_left_out(known, selection_);
  for (const auto& name : names) open(name);
  auto stream = invocation_.client().stream(machines_, &cell::v1::CellService::Stub::WatchMachines,
                                            cell::v1::WatchMachinesRequest());
  for (cell::v1::WatchMachinesResponse change; stream.read(change);)
    for (const auto& machine : change.machines())
      if (selection_.has(machine.name()) && answers(machine)) open(machine.name());
  const auto status = stream.finish();
  const std::lock_guard lock(mutex_);
  if (refusal_) throw Failure(*refusal_);
  if (ended_) return;
  if (status.ok()) throw Failure(ExitCode::unreachable, "the entrance ended the stream");
  throw invocation_.client().failure(status, "");
}

void MachineStreams::end() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  machines_.TryCancel();
  for (auto& [name, machine] : open_)
    if (machine.context != nullptr) machine.context->TryCancel();
  changed_.notify_all();
}

void MachineStreams::flows(const std::string& name) { note(name, std::nullopt); }

void MachineStreams::open(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (ended_ || open_.contains(name)) return;
  open_[name].thread = std::thread([this, name] { follow(name); });
}

void MachineStreams::follow(const std::string& name) {
  const auto client = invocation_.client().at(name);
  for (;;) {
    grpc::ClientContext context;
    {
      const std::lock_guard lock(mutex_);
      if (ended_) return;
      open_[name].context = &context;
    }
    const auto failure = read_(client, context, name);
    {
      const std::lock_guard lock(mutex_);
      open_[name].context = nullptr;
      if (ended_) return;
    }
    if (failure.code() != ExitCode::unreachable) return refused(name, failure);
    note(name, failure);
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, pause, [this] { return ended_; })) return;
  }
}

void MachineStreams::refused(const std::string& name, const Failure& why) {
  if (selection_.everything()) return note(name, why);  // the others go on
  {
    const std::lock_guard lock(mutex_);
    refusal_ = why;
  }
  end();
}

void MachineStreams::note(const std::string& name, const std::optional<Failure>& trouble) {
  const std::string text = trouble ? trouble->what() : "";
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(open_[name].trouble, text) == text) return;
  }
  tell_(name, trouble);
}

}  // namespace axisd::axisctl
