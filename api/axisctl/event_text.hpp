// Events as lines. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axisd/v1/event_service.pb.h"

namespace axisd::axisctl {

/// "2026-01-02T03:04:05.678Z  12  feeder  X0 home on (within 20 ms)".
std::string event_line(const v1::Event& event);
/// "X0 home on (within 20 ms)".
std::string content_text(const v1::Event& event);
/// "axes.feeder changed (limits.velocity)".
std::string text_of(const v1::ConfigChange& change);
/// "terminal-edge", "configuration-reloaded" ..., or their first words, of which "configuration" is the
/// drift. Throws Failure (usage).
v1::EventKind parse_event_kind(std::string_view text);
/// "terminal-edge", "state-change" ...: all of them.
std::vector<std::string> event_kinds();

}  // namespace axisd::axisctl
