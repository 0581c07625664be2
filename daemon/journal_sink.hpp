#pragma once

#include <spdlog/sinks/base_sink.h>

#include <mutex>

namespace axisd {

/// Hands lines to the journal with the fields that they have (buses/log_about.hpp). What it does not take
/// goes to stderr as text.
class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& line) override;
  void flush_() override {}
};

}  // namespace axisd
