// Events as messages. No decisions are made here.
#pragma once

#include "axisd/v1/event_service.pb.h"
#include "devices/event.hpp"

namespace axisd::server {

[[nodiscard]] v1::EventKind kind_of(const Event& event);
void to_proto(const Event& from, v1::Event& to);

}  // namespace axisd::server
