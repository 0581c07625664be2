#include "api/program/program.hpp"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <utility>

namespace axisd::program {

namespace {

/// Lines that nobody takes; beyond that the oldest get lost.
constexpr std::size_t log_queue = 8192;

}  // namespace

void start_logging(const std::string& name, const std::string& level) {
  spdlog::init_thread_pool(log_queue, 1);
  auto logger = spdlog::create_async_nb<spdlog::sinks::stderr_sink_mt>(name);
  logger->flush_on(spdlog::level::warn);
  logger->set_pattern(std::getenv("JOURNAL_STREAM") != nullptr ? "%l: %v" : "%Y-%m-%d %H:%M:%S.%e %l: %v");
  logger->set_level(spdlog::level::from_str(level == "warn" ? "warning" : level));
  spdlog::set_default_logger(std::move(logger));
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  // It would tell of every message that cannot be read.
  google::protobuf::SetLogHandler(nullptr);
}

void leave_at_once(int status) {
  spdlog::shutdown();
  std::_Exit(status);
}

int give_up(const std::string& name, const Error& error) {
  std::cerr << name << ": " << to_string(error) << '\n';
  return error.reason == Reason::invalid_argument ? wrong : failed;
}

}  // namespace axisd::program
