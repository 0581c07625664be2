#include "daemon/core/flight_recorder.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace axisd::core {
namespace {

constexpr std::size_t longest_reasons = 400;

/// `frames` is a copy, so that the core goes on.
std::string render(const std::string& head, const std::string& bus, const FrameRing& frames) {
  auto text = head;
  auto place = frames.begin();
  for (FrameRing::Read read; frames.read(place, read);) append_line(text, bus, read.frame);
  return text;
}

}  // namespace

FlightRecorder::FlightRecorder(Clock& clock, store::RecordFiles* files, Written written)
    : clock_(&clock), files_(files), written_(std::move(written)) {}

void FlightRecorder::fault(const BusRecorder& recorder, const std::string& axis, const std::string& reason) {
  if (files_ == nullptr) return;
  auto& pending = pending_[recorder.bus()];
  if (!pending.reasons.empty()) {
    if (pending.reasons.find(reason) != std::string::npos) return;
    if (pending.reasons.size() + reason.size() > longest_reasons)
      ++pending.further;
    else
      pending.reasons += "; " + reason;
    return;
  }
  pending.recorder = &recorder;
  pending.axis = axis;
  pending.reasons = reason;
  auto when = clock_->now() + aftermath;
  if (pending.written) when = std::max(when, *pending.written + interval);
  pending.timer = clock_->call_at(when, [this, &pending] { due(pending); });
}

void FlightRecorder::close() {
  for (auto& [bus, pending] : pending_) {
    pending.timer.reset();
    if (!pending.reasons.empty()) due(pending);
  }
}

void FlightRecorder::due(Pending& pending) {
  const auto& recorder = *pending.recorder;
  pending.written = clock_->now();
  auto reasons = std::exchange(pending.reasons, {});
  if (const auto further = std::exchange(pending.further, 0); further > 0)
    reasons += fmt::format("; and {} more", further);
  write(recorder, reasons,
        [bus = recorder.bus(), axis = pending.axis, reasons, written = written_](Result<std::string> name) {
          if (name) {
            spdlog::warn("{}: flight record {}: {}", bus, *name, reasons);
            written(axis, {.bus = bus, .name = *std::move(name), .reason = reasons});
          } else {
            spdlog::error("{}: no flight record was written: {}", bus, to_string(name.error()));
          }
        });
}

void FlightRecorder::write(const BusRecorder& recorder, const std::string& reason,
                           std::function<void(Result<std::string>)> done) {
  if (files_ == nullptr)
    return done(fail(Reason::not_supported, "no flight records are kept here", "set state_directory"));
  const auto now = clock_->now();
  const auto wall = clock_->wall(now);
  const auto name = store::record_name(recorder.bus(), wall);
  auto head = store::record_head(recorder.bus(), reason, now, wall);
  files_->write(
      name,
      [head = std::move(head), bus = recorder.bus(),
       frames = std::make_shared<const FrameRing>(recorder.frames())] { return render(head, bus, *frames); },
      [name, done = std::move(done)](const Result<void>& saved) {
        done(saved ? Result<std::string>(name) : fail(saved.error()));
      });
}

}  // namespace axisd::core
