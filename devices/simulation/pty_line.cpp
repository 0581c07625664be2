#include "devices/simulation/pty_line.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "devices/simulation/crc.hpp"
#include "devices/simulation/pty_serial.hpp"

namespace axisd::simulation {

namespace {

using namespace std::chrono_literals;

/// How soon a client that opens the terminal again is noticed (a pty without one cannot be waited on).
constexpr auto orphan_poll = 2ms;

std::unexpected<Error> system_failure(std::string_view what) {
  const int number = errno;
  return fail(Reason::bus_down, fmt::format("{}: {}", what, std::strerror(number)),
              "check the path and the permissions");
}

Result<void> make_link(const std::string& link, const std::string& target) {
  struct stat status{};
  if (lstat(link.c_str(), &status) == 0 && !S_ISLNK(status.st_mode)) {
    errno = EEXIST;
    return system_failure(link);
  }
  // Renamed into place, so that nobody finds the path missing while it is replaced.
  const auto temporary = link + ".new";
  unlink(temporary.c_str());
  if (symlink(target.c_str(), temporary.c_str()) != 0) return system_failure(link);
  if (rename(temporary.c_str(), link.c_str()) != 0) return system_failure(link);
  return {};
}

void remove_link(const std::string& link, const std::string& target) {
  std::array<char, 256> found{};
  const auto size = readlink(link.c_str(), found.data(), found.size() - 1);
  if (size > 0 && target == found.data()) unlink(link.c_str());
}

/// Length of the request at the front by its function; 0 if that does not tell.
std::size_t request_size(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 8) return 0;
  if (bytes[1] == 0x10) return 9U + bytes[6];
  return 8;
}

}  // namespace

PtyLine::Held::Held(PtyLine& line) : line_(line), lock_(line.mutex_) {
  line_.network_.advance(monotonic_now());
  line_.queue_replies();
}

PtyLine::Held::~Held() {
  lock_.unlock();
  line_.wake();
}

PtyLine::PtyLine(PtyLineSettings settings)
    : settings_(std::move(settings)), network_({.turnaround = settings_.turnaround}) {
  network_.set_serial(settings_.serial);
  network_.set_observer(settings_.observer);
}

Result<std::unique_ptr<PtyLine>> PtyLine::open(PtyLineSettings settings,
                                               std::vector<std::unique_ptr<SimulatedRtuNode>> nodes) {
  std::unique_ptr<PtyLine> line(new PtyLine(std::move(settings)));
  line->network_.advance(monotonic_now());
  for (auto& node : nodes) line->network_.add(std::move(node));
  line->wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (line->wake_fd_ < 0) return system_failure("eventfd");
  if (auto plugged = line->plug(); !plugged) return std::unexpected(plugged.error());
  line->thread_ = std::thread([raw = line.get()] { raw->run(); });
  return line;
}

PtyLine::~PtyLine() {
  stopping_ = true;
  wake();
  if (thread_.joinable()) thread_.join();
  unplug();
  if (wake_fd_ >= 0) close(wake_fd_);
}

Result<void> PtyLine::plug() {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master < 0) return system_failure("posix_openpt");
  std::array<char, 128> name{};
  if (grantpt(master) != 0 || unlockpt(master) != 0 || ptsname_r(master, name.data(), name.size()) != 0 ||
      !set_pty_serial(master, settings_.serial)) {
    auto failure = system_failure("pty");
    close(master);
    return failure;
  }
  terminal_ = name.data();
  if (!settings_.link.empty()) {
    if (auto linked = make_link(settings_.link, terminal_); !linked) {
      close(master);
      return linked;
    }
  }
  master_ = master;
  orphaned_ = false;
  return {};
}

void PtyLine::unplug() {
  if (master_ < 0) return;
  if (!settings_.link.empty()) remove_link(settings_.link, terminal_);
  close(master_);
  master_ = -1;
  lots_.clear();
}

std::string PtyLine::path() const {
  const std::scoped_lock lock(mutex_);
  return settings_.link.empty() ? terminal_ : settings_.link;
}

void PtyLine::hang_up() {
  const Held held(*this);
  unplug();
}

Result<void> PtyLine::replug() {
  const Held held(*this);
  return master_ >= 0 ? Result<void>{} : plug();
}

bool PtyLine::plugged() const {
  const std::scoped_lock lock(mutex_);
  return master_ >= 0;
}

void PtyLine::wake() {
  const std::uint64_t one = 1;
  // The counter only overflows after 2^64 calls, so a failure cannot lose a wake-up.
  [[maybe_unused]] const auto written = write(wake_fd_, &one, sizeof(one));
}

void PtyLine::run() {
  use_precise_waits();
  while (!stopping_) {
    TimePoint until;
    bool orphaned = false;
    int master = -1;
    {
      const std::scoped_lock lock(mutex_);
      const auto now = monotonic_now();
      read_master(now);
      network_.advance(now);
      queue_replies();
      if (network_.take_hang_up()) unplug();
      write_due(now);
      until = std::min(network_.next_event(), lots_.empty() ? TimePoint::max() : lots_.front().when);
      orphaned = orphaned_;
      // A pty's number may be reused once it is closed, so another thread's unplug() must not outrun the poll
      // below.
      master = master_ < 0 ? -1 : fcntl(master_, F_DUPFD_CLOEXEC, 0);
    }
    wait(until, orphaned, master);
  }
}

void PtyLine::wait(TimePoint until, bool orphaned, int master) {
  // Without a client the terminal reports its hang-up all the time: look again a little later.
  const auto now = monotonic_now();
  if (orphaned) until = std::min(until, now + orphan_poll);
  std::array<pollfd, 2> waited{{{wake_fd_, POLLIN, 0}, {orphaned ? -1 : master, POLLIN, 0}}};
  timespec timeout{};
  if (until != TimePoint::max()) {
    const auto left = std::max<std::int64_t>(0, std::chrono::nanoseconds(until - now).count());
    timeout = {.tv_sec = left / 1'000'000'000, .tv_nsec = left % 1'000'000'000};
  }
  ppoll(waited.data(), waited.size(), until == TimePoint::max() ? nullptr : &timeout, nullptr);
  if (master >= 0) close(master);
  if ((waited[0].revents & POLLIN) == 0) return;
  std::uint64_t count = 0;
  [[maybe_unused]] const auto drained = read(wake_fd_, &count, sizeof(count));
}

void PtyLine::read_master(TimePoint now) {
  if (master_ < 0) return;
  std::array<std::uint8_t, 1024> buffer{};
  // The descriptor is non-blocking. NOLINTNEXTLINE(clang-analyzer-unix.BlockInCriticalSection)
  const auto size = read(master_, buffer.data(), buffer.size());
  if (size > 0) {
    orphaned_ = false;
    if (const auto serial = pty_serial(master_, settings_.serial)) network_.set_serial(*serial);
    receive(std::span(buffer).first(static_cast<std::size_t>(size)), now);
  } else if (size < 0 && errno == EIO) {
    orphaned_ = true;
    lots_.clear();  // as a serial port forgets its input when the last user closes it
  } else {
    orphaned_ = false;
  }
}

/// One read may hold several requests when this thread came late; they were sent one by one, so they are
/// taken so.
void PtyLine::receive(std::span<const std::uint8_t> bytes, TimePoint now) {
  auto frame = bytes;
  for (auto size = request_size(frame); size != 0 && size < frame.size(); size = request_size(frame)) {
    if (!frame_is_sound(frame.first(size))) break;
    if (auto reply = network_.on_request(frame.first(size), now)) network_.add_reply(std::move(*reply));
    frame = frame.subspan(size);
  }
  network_.on_bytes(frame, now);
}

void PtyLine::queue_replies() {
  while (auto reply = network_.take_reply()) {
    if (master_ < 0 || !network_.connected()) continue;
    std::size_t first = 0;
    for (std::size_t i = 0; i < reply->bytes.size(); ++i) {
      const bool last = i + 1 == reply->bytes.size();
      if (i != 0 && !last && reply->arrivals[i + 1] - reply->arrivals[first] <= 1ms) continue;
      lots_.push_back({reply->arrivals[i],
                       {reply->bytes.begin() + static_cast<std::ptrdiff_t>(first),
                        reply->bytes.begin() + static_cast<std::ptrdiff_t>(i) + 1}});
      first = i + 1;
    }
  }
}

void PtyLine::write_due(TimePoint now) {
  while (!lots_.empty() && lots_.front().when <= now) {
    if (master_ >= 0 && network_.connected()) {
      // A client that does not read loses bytes, as it would on a real port.
      [[maybe_unused]] const auto written =
          write(master_, lots_.front().bytes.data(), lots_.front().bytes.size());
    }
    lots_.pop_front();
  }
}

}  // namespace axisd::simulation
