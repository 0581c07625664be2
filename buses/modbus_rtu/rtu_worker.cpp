#include "buses/modbus_rtu/rtu_worker.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "buses/heartbeat.hpp"
#include "buses/log_about.hpp"
#include "buses/modbus_rtu/serial_port.hpp"
#include "buses/modbus_rtu/wire_session.hpp"

namespace axisd::modbus_rtu {
namespace {

constexpr Duration first_back_off = std::chrono::milliseconds(100);
constexpr Duration longest_back_off = std::chrono::seconds(1);
/// A stop needs some 0.1 ms from its arrival to the slot. Where the core is later than this, the line goes
/// on.
constexpr Duration longest_yield = std::chrono::milliseconds(5);
/// How often a worker that waits for a stop looks whether it is still on its way.
constexpr Duration between_looks = std::chrono::microseconds(200);

/// Signals are the main thread's; those that a thread raises by its own fault must stay deliverable.
sigset_t all_but_faults() {
  sigset_t signals;
  sigfillset(&signals);
  for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP}) sigdelset(&signals, fault);
  return signals;
}

Error lost_error(const LineSettings& line, const std::string& path, int native_error) {
  Error error{
      .reason = Reason::bus_down,
      .message = fmt::format("port {} was lost: {}", path, std::system_category().message(native_error)),
      .remedy = "check the adapter and its cable; it is opened again by itself"};
  error.where.bus = line.name;
  error.where.native_code = static_cast<std::uint32_t>(native_error);
  return error;
}

}  // namespace

const Exchange RtuWorker::nothing_more;

RtuWorker::RtuWorker(Executor core, LineSettings settings, PortPath port_path)
    : core_(std::move(core)),
      settings_(std::move(settings)),
      port_path_(std::move(port_path)),
      progress_(monotonic_now().time_since_epoch().count()) {}

RtuWorker::~RtuWorker() {
  callbacks_->alive = false;
  wakeup_.quit.store(true, std::memory_order_release);
  slot_.store(&nothing_more);
  wakeup_.notify();
  if (thread_.joinable()) thread_.join();
}

void RtuWorker::start(ResultHandler on_result, PortHandler on_port) {
  callbacks_->on_result = std::move(on_result);
  callbacks_->on_port = std::move(on_port);
  // A new thread inherits the mask: blocked here first, no signal can find it unprotected.
  const auto blocked = all_but_faults();
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, &blocked, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void RtuWorker::arm(const Exchange& exchange) {
  wakeup_.cut.store(false, std::memory_order_release);  // a cut that came too late is not meant for this one
  stop_armed_.store(exchange.stop);
  // Sequentially consistent on both sides: either the worker sees the slot, or we see that it sleeps.
  slot_.store(&exchange);
  if (idle_.load()) wakeup_.notify();
}

std::optional<std::span<const ExchangeResult>> RtuWorker::revoke() {
  const auto* was = slot_.exchange(&nothing_more);
  if (was == nullptr || was == &nothing_more) return std::nullopt;
  return take_results();
}

bool RtuWorker::armed() const {
  const auto* exchange = slot_.load();
  return exchange != nullptr && exchange != &nothing_more;
}

/// What is armed, out of the slot; or nullptr.
const Exchange* RtuWorker::take() {
  const auto* exchange = slot_.exchange(nullptr, std::memory_order_acq_rel);
  return exchange == &nothing_more ? nullptr : exchange;
}

std::span<const ExchangeResult> RtuWorker::take_results() {
  callbacks_->told.clear();
  callbacks_->told.swap(results_);
  return callbacks_->told;
}

void RtuWorker::cut_wait() {
  if (!wakeup_.cut.exchange(true, std::memory_order_acq_rel)) wakeup_.notify();
}

TimePoint RtuWorker::last_progress() const {
  return TimePoint(TimePoint::duration(progress_.load(std::memory_order_relaxed)));
}

void RtuWorker::touch() {
  progress_.store(monotonic_now().time_since_epoch().count(), std::memory_order_relaxed);
}

void RtuWorker::expect_port_call() {
  progress_.store((monotonic_now() + longest_port_call).time_since_epoch().count(),
                  std::memory_order_relaxed);
}

void RtuWorker::run() {
  constexpr std::size_t longest_name = 15;
  pthread_setname_np(pthread_self(), ("rtu:" + settings_.name).substr(0, longest_name).c_str());
  use_precise_waits();
  auto back_off = first_back_off;
  auto closed_since = monotonic_now();
  while (!quitting()) {
    expect_port_call();
    auto port = open_port();
    touch();
    const bool opened = port.has_value();
    if (opened) back_off = first_back_off;
    const auto error = port ? serve(std::move(*port), closed_since) : std::move(port.error());
    touch();
    if (quitting()) return;
    if (opened) closed_since = monotonic_now();
    report(PortStatus{.open = false, .error = error});
    wait_closed(back_off, static_cast<int>(error.where.native_code.value_or(0)));
    back_off = std::min(2 * back_off, longest_back_off);
  }
}

Result<SerialPort> RtuWorker::open_port() {
  if (!port_path_) return SerialPort::open(settings_, settings_.port);
  auto path = port_path_();
  if (!path) return fail(std::move(path.error()));
  return SerialPort::open(settings_, *path);
}

/// Serves the slot until the port is lost (the error says how) or the worker is to end.
Error RtuWorker::serve(SerialPort port, TimePoint closed_since) {
  const auto path = port.path();
  WireSession session(std::move(port), settings_, wakeup_, progress_);
  // One that was asked for while the port was closed goes out as soon as the core knows of the open port.
  int lost = session.find_echo([&] { return quitting() || stop_notice_->given() >= closed_since; });
  const std::function<bool()> stop_waits = [this] {
    return quitting() || awaits_stop() || (stop_armed_.load() && armed());
  };
  if (lost == 0) report(PortStatus{.open = true, .error = {}});
  while (lost == 0 && !quitting()) {
    touch();
    lost = session.find_echo(stop_waits);
    if (lost == 0) lost = session.keep_silence();
    if (lost != 0) break;
    bool announced = false;
    session.finish_silence([&] { return announced = awaits_stop(); });
    if (yield_to_stop() || announced) continue;
    // As late as possible, when the silence is over: until here a stop could take the exchange back.
    const auto* exchange = take();
    yielded_ = false;
    if (exchange != nullptr)
      bind(session, *exchange, lost);
    else
      idle(session, lost);
  }
  return lost_error(settings_, path, lost);
}

/// Gives the port the serial settings of `exchange`. False: it was reported as not sent.
bool RtuWorker::prepare(WireSession& session, const Exchange& exchange, int& lost) {
  const auto wanted = exchange.serial.value_or(settings_.serial());
  if (session.uses(wanted)) return true;
  expect_port_call();
  const int failed = session.use(wanted);
  touch();
  if (failed == EINVAL && exchange.serial) {
    const auto now = monotonic_now();
    report(exchange, ExchangeResult{.status = ExchangeStatus::unsupported,
                                    .native_error = EINVAL,
                                    .request_begin = now,
                                    .request_end = now,
                                    .reply_end = now});
    return false;
  }
  lost = failed != 0 ? failed : session.keep_silence();  // the silence of the new rate may be longer
  if (lost == 0) return true;
  report(PortStatus{.open = false, .error = lost_error(settings_, session.path(), lost)});
  report(exchange, ExchangeResult{.status = ExchangeStatus::not_sent, .native_error = lost});
  return false;
}

void RtuWorker::bind(WireSession& session, const Exchange& exchange, int& lost) {
  if (!prepare(session, exchange, lost)) return;
  const auto now = session.finish_silence();
  const auto verdict = now > exchange.deadline ? Verdict::expired : may_send(exchange.guard, now);
  if (verdict != Verdict::send) {
    report(exchange, ExchangeResult{.status = ExchangeStatus::not_sent,
                                    .verdict = verdict,
                                    .request_begin = now,
                                    .request_end = now,
                                    .reply_end = now});
    return;
  }
  const auto result = session.run(exchange);
  if (result.status == ExchangeStatus::io_error) {
    lost = result.native_error;
    // First the port, then the result: the core must not arm the next exchange on it.
    report(PortStatus{.open = false, .error = lost_error(settings_, session.path(), lost)});
  }
  report(exchange, result);
}

/// A stop is on its way to the core, and what is armed knows nothing of it.
bool RtuWorker::awaits_stop() const { return !yielded_ && !stop_armed_.load() && stop_notice_->pending(); }

/// Such a stop is let in first. Once per exchange, so that no flood of stops keeps the others off the line.
/// True: time has passed, which may have brought bytes.
bool RtuWorker::yield_to_stop() {
  if (!awaits_stop()) return false;
  const auto until = stop_notice_->given() + longest_yield;  // one that is given meanwhile prolongs nothing
  for (auto now = monotonic_now(); now < until && awaits_stop() && !quitting(); now = monotonic_now()) {
    touch();
    idle_.store(true);
    if (!stop_armed_.load()) wakeup_.wait(std::min(until - now, between_looks));
    idle_.store(false);
  }
  yielded_ = true;
  return true;
}

void RtuWorker::idle(WireSession& session, int& lost) {
  idle_.store(true);
  if (!armed() && !quitting()) lost = session.idle(heartbeat);
  idle_.store(false);
}

/// Passes the time until the next attempt to open; what is armed meanwhile ends unsent.
void RtuWorker::wait_closed(Duration duration, int native_error) {
  const auto until = monotonic_now() + duration;
  while (!quitting() && monotonic_now() < until) {
    touch();
    idle_.store(true);
    if (const auto* exchange = take()) {
      report(*exchange, ExchangeResult{.status = ExchangeStatus::not_sent, .native_error = native_error});
    } else {
      wakeup_.wait(std::min<Duration>(until - monotonic_now(), heartbeat));
    }
    idle_.store(false);
  }
}

/// Of a round that says nothing new the core hears at its end: to wake it costs as much as an exchange.
void RtuWorker::report(const Exchange& exchange, const ExchangeResult& result) {
  results_.push_back(result);
  const Exchange* empty = nullptr;
  // From then on all of it is the core's again, if it takes the next one back.
  if (round_goes_on(exchange, results_) && slot_.compare_exchange_strong(empty, exchange.then)) return;
  tell();
}

void RtuWorker::tell() {
  post(core_, [this, callbacks = callbacks_] {
    if (callbacks->alive) callbacks->on_result(take_results());
  });
}

void RtuWorker::report(const PortStatus& status) {
  auto text = status.error ? to_string(*status.error) : std::string();
  if (!status.open && text == reported_error_) return;
  if (status.open)
    log_about(spdlog::level::info, LogKind::bus_up, {.bus = settings_.name},
              fmt::format("{}: port {} is open", settings_.name, settings_.port));
  else
    log_about(spdlog::level::warn, LogKind::bus_down, {.bus = settings_.name}, text);
  reported_error_ = std::move(text);
  post(core_, [callbacks = callbacks_, status] {
    if (callbacks->alive) callbacks->on_port(status);
  });
}

}  // namespace axisd::modbus_rtu
