#include "daemon/logging.hpp"

#include <fmt/format.h>
#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "buses/log_about.hpp"
#include "daemon/journal_sink.hpp"

namespace axisd {

namespace {

constexpr std::size_t queue_size = 16'384;

std::shared_ptr<spdlog::logger> make_async(const char* name, spdlog::sink_ptr sink,
                                           std::weak_ptr<spdlog::details::thread_pool> writer) {
  return std::make_shared<spdlog::async_logger>(name, std::move(sink), std::move(writer),
                                                spdlog::async_overflow_policy::overrun_oldest);
}

/// Whether what is written to stderr goes to the journal: whoever sends it elsewhere leaves JOURNAL_STREAM as
/// it was (systemd.exec(5)).
bool stderr_is_the_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat actual{};
  if (stream == nullptr || fstat(STDERR_FILENO, &actual) != 0) return false;
  return fmt::format("{}:{}", actual.st_dev, actual.st_ino) == stream;
}

}  // namespace

Logging::Logging(const std::string& level)
    : writer_(std::make_shared<spdlog::details::thread_pool>(queue_size, 1)) {
  const bool journal = stderr_is_the_journal();
  set_log_fields(journal);
  spdlog::sink_ptr sink;
  if (journal)
    sink = std::make_shared<JournalSink>();
  else
    sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  auto logger = make_async("axisd", std::move(sink), writer_);
  logger->set_pattern(journal ? "%v" : "%Y-%m-%d %H:%M:%S.%e %^%l%$ %v");
  logger->set_level(spdlog::level::from_str(level == "warn" ? "warning" : level));
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

Logging::~Logging() {
  writer_.reset();
  spdlog::shutdown();
}

void Logging::leave_at_once(int status) {
  spdlog::set_level(spdlog::level::off);
  writer_.reset();  // the loggers stay: whoever is just using one must find it
  std::_Exit(status);
}

Result<core::FrameObserver> Logging::open_wire_log(const std::string& path) const {
  std::shared_ptr<spdlog::logger> log;
  try {
    log = make_async("wire", std::make_shared<spdlog::sinks::basic_file_sink_mt>(path), writer_);
  } catch (const spdlog::spdlog_ex& error) {
    return fail(Reason::storage, error.what(), "choose another --wire-log");
  }
  // The line brings its end along.
  log->set_formatter(std::make_unique<spdlog::pattern_formatter>("%v", spdlog::pattern_time_type::local, ""));
  log->set_level(spdlog::level::trace);
  log->flush_on(spdlog::level::trace);
  return [log, line = std::string()](const std::string& bus, const TracedFrame& frame) mutable {
    line.clear();
    append_line(line, bus, frame);
    log->info(std::string_view(line));
  };
}

}  // namespace axisd
