#include "daemon/configuration_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <fstream>
#include <future>
#include <utility>

#include "buses/limited_log.hpp"
#include "buses/regular_file.hpp"
#include "config/budget.hpp"
#include "config/clients_text.hpp"
#include "config/document.hpp"
#include "config/fields.hpp"
#include "daemon/store/line_text.hpp"
#include "daemon/store/thread.hpp"

namespace axisd {

namespace {

/// Checks and the like that may wait for others.
constexpr std::size_t most_looks = 8;
/// Spent on one of them; the others wait meanwhile.
constexpr auto longest_look = std::chrono::seconds(2);

std::vector<ConfigurationFinding> findings_of(std::vector<config::Diagnostic> diagnostics) {
  std::vector<ConfigurationFinding> findings;
  findings.reserve(diagnostics.size());
  for (auto& found : diagnostics)
    findings.push_back({.line = static_cast<std::uint32_t>(found.line),
                        .column = static_cast<std::uint32_t>(found.column),
                        .message = std::move(found.message),
                        .suggestion = std::move(found.suggestion)});
  return findings;
}

std::shared_ptr<const ServedConfiguration> served_from(const std::string& path, const std::string& yaml,
                                                       WallTime since) {
  return std::make_shared<const ServedConfiguration>(
      ServedConfiguration{.yaml = yaml, .path = path, .revision = revision_of(yaml), .served_since = since});
}

/// Whole or not at all: `--quiesce` reads it when everything else went wrong.
void write_copy(const std::filesystem::path& path, const std::string& yaml) {
  auto fresh = path;
  fresh += ".new";
  std::ofstream(fresh, std::ios::binary | std::ios::trunc) << yaml;
  std::error_code error;  // the copy is a convenience
  if (std::filesystem::file_size(fresh, error) == yaml.size() && !error)
    std::filesystem::rename(fresh, path, error);
  if (error) spdlog::warn("{}: {}", path.string(), error.message());
}

Error under_way() {
  return {.reason = Reason::busy,
          .message = "another reload of the configuration is under way",
          .remedy = "wait for its end"};
}

Error too_many_look() {
  return {.reason = Reason::busy,
          .message = "other configurations are being checked",
          .remedy = "wait for the end of these checks, then ask again"};
}

Error closing() {
  return {.reason = Reason::cancelled,
          .message = "the daemon is shutting down",
          .remedy = "it reads the file when it is started again"};
}

}  // namespace

std::string revision_of(std::string_view yaml) {
  return fmt::format("{:08x}-{}", store::crc32(yaml), yaml.size());
}

ConfigurationService::ConfigurationService(Parts parts)
    : parts_(std::move(parts)),
      served_(served_from(parts_.path, parts_.yaml, parts_.since)),
      named_(config::named_files(parts_.configuration)),
      looks_(most_looks) {
  thread_ = store::start_thread("axisd-config", [this] { run(); });
}

ConfigurationService::~ConfigurationService() { close(); }

void ConfigurationService::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
  looks_.close();
}

std::shared_ptr<const ServedConfiguration> ConfigurationService::served() const {
  const std::lock_guard lock(mutex_);
  return served_;
}

std::set<std::string> ConfigurationService::named_files() const {
  const std::lock_guard lock(mutex_);
  return named_;
}

void ConfigurationService::file_revision(std::function<void(Result<std::string>)> callback) {
  const bool taken = looks_.post([this, callback] {
    const auto text = read_regular_file(parts_.path, config::largest_text);
    callback(text ? revision_of(*text) : std::string());
  });
  if (!taken) callback(fail(too_many_look()));
}

void ConfigurationService::check(std::string yaml, std::function<void(Result<ConfigurationCheck>)> callback) {
  const bool taken = looks_.post([this, callback, yaml = std::move(yaml)] {
    auto loaded = config::load_clients_text(yaml, parts_.path, named_files(), parts_.check_tls, longest_look);
    callback(ConfigurationCheck{.findings = findings_of(std::move(loaded.diagnostics)),
                                .warnings = loaded.configuration ? config::warnings(*loaded.configuration)
                                                                 : std::vector<std::string>(),
                                .revision = revision_of(yaml)});
  });
  if (!taken) callback(fail(too_many_look()));
}

void ConfigurationService::reload(std::string client, bool dry_run,
                                  std::function<void(Result<ConfigurationReload>)> callback) {
  std::unique_lock lock(mutex_);
  if (closing_ || busy_) {
    const auto error = closing_ ? closing() : under_way();
    lock.unlock();
    return callback(fail(error));
  }
  busy_ = true;
  request_ = Request{.client = std::move(client), .dry_run = dry_run, .callback = std::move(callback)};
  lock.unlock();
  wake_.notify_one();
}

void ConfigurationService::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || request_; });
    if (!request_) return;
    const auto request = *std::exchange(request_, std::nullopt);
    const bool ending = closing_;
    lock.unlock();
    auto result = ending ? Result<ConfigurationReload>(fail(closing())) : serve(request);
    lock.lock();
    busy_ = false;  // whoever is told may ask for the next one at once
    lock.unlock();
    request.callback(std::move(result));
    lock.lock();
  }
}

ConfigurationReload ConfigurationService::serve(const Request& request) {
  ConfigurationReload result{.before = served()->revision};
  auto loaded = parts_.load();
  result.revision = revision_of(loaded.text);
  if (!loaded.configuration) {
    result.findings = findings_of(std::move(loaded.diagnostics));
    for (const auto& found : result.findings)
      log_limited(spdlog::level::warn, request.client, "reloads",
                  fmt::format("reloads the configuration: {}:{}:{}: {}", parts_.path, found.line,
                              found.column, found.message),
                  LogKind::configuration_refused, {.client = request.client});
    return result;
  }
  auto& configuration = *loaded.configuration;
  auto budgets = config::budgets(configuration);
  result.warnings = config::warnings(configuration);
  result.changes = config::differences(parts_.configuration, configuration);
  core::Reload reload{.client = request.client,
                      .configuration = configuration,
                      .changes = result.changes,
                      .budgets = std::move(budgets),
                      .before = result.before,
                      .revision = result.revision};
  auto answer = std::make_shared<std::promise<std::vector<Error>>>();
  parts_.apply(std::move(reload), request.dry_run,
               [answer](std::vector<Error> refusals) { answer->set_value(std::move(refusals)); });
  result.refusals = answer->get_future().get();
  for (const auto& refusal : result.refusals)
    log_limited(spdlog::level::warn, request.client, "reloads",
                fmt::format("reloads the configuration, which is refused: {}", to_string(refusal)),
                LogKind::configuration_refused, {.client = request.client});
  result.applied = result.refusals.empty() && !request.dry_run;
  if (!result.applied) return result;
  for (const auto& warning : result.warnings) spdlog::warn("{}", warning);
  adopt(std::move(configuration), loaded.text);
  return result;
}

void ConfigurationService::adopt(config::Configuration configuration, const std::string& yaml) {
  parts_.configuration = std::move(configuration);
  if (parts_.adopted) parts_.adopted(parts_.configuration);
  if (revision_of(yaml) == served()->revision) return;
  auto next = served_from(parts_.path, yaml, std::chrono::system_clock::now());
  auto named = config::named_files(parts_.configuration);
  {
    const std::lock_guard lock(mutex_);
    served_ = std::move(next);
    named_ = std::move(named);
  }
  keep_copy();
}

void ConfigurationService::keep_copy() const { write_copy(parts_.last_good, served()->yaml); }

}  // namespace axisd
