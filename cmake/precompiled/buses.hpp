// What nearly every file includes: the standard library, fmt, spdlog, and the coroutines that everything
// waits in.
#pragma once

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "buses/clock.hpp"
#include "buses/error.hpp"
#include "buses/gate.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
