#include "daemon/logging.hpp"

#include <spdlog/async.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <memory>

namespace axisd {

namespace {

constexpr std::size_t queue_size = 16'384;

std::shared_ptr<spdlog::logger> make_async(const char* name, spdlog::sink_ptr sink) {
  return std::make_shared<spdlog::async_logger>(name, std::move(sink), spdlog::thread_pool(),
                                                spdlog::async_overflow_policy::overrun_oldest);
}

const char* why(const modbus_rtu::ExchangeResult& result) {
  using modbus_rtu::ExchangeStatus;
  switch (result.status) {
    case ExchangeStatus::replied:
      return "replied";
    case ExchangeStatus::timeout:
      return "timeout";
    case ExchangeStatus::cut:
      return "cut";
    case ExchangeStatus::corrupt:
      return "corrupt";
    case ExchangeStatus::not_sent:
      return result.verdict == Verdict::expired ? "not sent: expired" : "not sent: superseded";
    case ExchangeStatus::unsupported:
      return "unsupported";
    case ExchangeStatus::io_error:
      return "port lost";
  }
  return "?";
}

long long ns(TimePoint t) { return t.time_since_epoch().count(); }

modbus_rtu::ExchangeObserver log_exchanges(std::shared_ptr<spdlog::logger> log) {
  return [log = std::move(log)](const std::string& bus, const modbus_rtu::Exchange& exchange,
                                const modbus_rtu::ExchangeResult& result) {
    if (result.status != modbus_rtu::ExchangeStatus::not_sent &&
        result.status != modbus_rtu::ExchangeStatus::unsupported)
      log->info("{} {} tx {}", ns(result.request_begin), bus, modbus_rtu::to_hex(exchange.frame.bytes()));
    if (result.reply_frame.size() > 0)
      log->info("{} {} rx {}", ns(result.reply_begin), bus, modbus_rtu::to_hex(result.reply_frame.bytes()));
    if (result.status != modbus_rtu::ExchangeStatus::replied)
      log->info("{} {} -- {}", ns(result.reply_end), bus, why(result));
  };
}

core::NetworkObserver log_frames(const std::shared_ptr<spdlog::logger>& log) {
  return {
      .received =
          [log](const std::string& bus, const can::ReceivedFrame& received) {
            log->info("{} {} rx {}", ns(received.at), bus, can::to_string(received.frame));
          },
      .ended =
          [log](const std::string& bus, const can::Frame& frame, const can::SendResult& result,
                TimePoint at) {
            const bool sent = result.status == can::SendStatus::sent;
            const auto text = can::to_string(frame);
            if (sent || result.status == can::SendStatus::unknown)
              log->info("{} {} tx {}", ns(result.handed_over), bus, text);
            if (!sent) log->info("{} {} -- {} {}", ns(at), bus, text, can::to_string(result.status));
          },
      .state = [log](const std::string& bus, const can::PortState& state,
                     TimePoint at) { log->info("{} {} link {}", ns(at), bus, can::to_string(state.link)); }};
}

}  // namespace

void start_logging(const std::string& level) {
  spdlog::init_thread_pool(queue_size, 1);
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  spdlog::sink_ptr sink;
  if (journal)
    sink = std::make_shared<spdlog::sinks::systemd_sink_mt>("axisd");
  else
    sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  auto logger = make_async("axisd", std::move(sink));
  logger->set_pattern(journal ? "%v" : "%Y-%m-%d %H:%M:%S.%e %^%l%$ %v");
  logger->set_level(spdlog::level::from_str(level == "warn" ? "warning" : level));
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

void end_logging() { spdlog::shutdown(); }

Result<WireLog> open_wire_log(const std::string& path) {
  std::shared_ptr<spdlog::logger> log;
  try {
    log = make_async("wire", std::make_shared<spdlog::sinks::basic_file_sink_mt>(path));
  } catch (const spdlog::spdlog_ex& error) {
    return fail(Reason::storage, error.what(), "choose another --wire-log");
  }
  log->set_pattern("%v");
  log->set_level(spdlog::level::trace);
  log->flush_on(spdlog::level::trace);
  return WireLog{.exchanges = log_exchanges(log), .frames = log_frames(log)};
}

}  // namespace axisd
