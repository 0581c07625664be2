#include "api/web/gateway/gateway.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "api/web/gateway/http_rules.hpp"

namespace axisd::web {
namespace {

/// How soon sessions that are over end, users that were taken out lose theirs, and a lost daemon is looked
/// for.
constexpr Duration tick_period = std::chrono::seconds(1);

/// Calls that stop something: of all, and of each person.
constexpr int most_stops = 128, most_stops_each = 32;
constexpr Pace lines{.per_second = 1, .at_once = 30};

SessionLimits session_limits(const Settings& settings) {
  return {.idle = settings.session_idle, .longest = settings.session_longest};
}

}  // namespace

Gateway::Gateway(boost::asio::io_context& context, Clock& time, const Settings& said, Assets page,
                 People known, Machines daemons, const std::string& client_ca)
    : io(context),
      clock(time),
      settings(said),
      assets(std::move(page)),
      people(std::move(known)),
      machines(std::move(daemons)),
      authority(std::make_unique<PasswordAuthority>(people, context.get_executor())),
      connections(said.limits.connections, said.limits.connections_each),
      streams(said.limits.streams, said.limits.streams_each),
      lanes(said.limits.lanes, said.limits.lanes_each),
      stops(most_stops, most_stops_each),
      sessions(session_limits(said), [this](const Session& session) { end_session(session.id); }),
      lines_(lines) {
  if (!client_ca.empty()) identities_.emplace(client_ca);
  tick_later();
}

void Gateway::tick_later() {
  timer_ = clock.call_at(clock.now() + tick_period, [this] { tick(); });
}

void Gateway::tick() {
  tick_later();
  for (const auto& [name, upstream] : machines) {
    upstream->tell_trouble();
    upstream->stay_connected();
  }
  sessions.expire(clock.now());
  const bool others = people.refresh();
  sessions.end_if(
      [this](const Session& session) { return !authority->stands(session.person, session.proof); });
  if (!others) return;
  spdlog::info("{} users", people.users().size());
  for (const auto& guest : guests())
    if (const auto* person = guest->person(); person != nullptr && guest->session() == 0 && !stands(*person))
      guest->close();
}

bool Gateway::stands(const Person& person) const {
  if (person.how == How::loopback) return people.nobody();
  return person.how == How::certificate && person.role == role_of_certificate(people.users(), person.name);
}

bool Gateway::may_tell() {
  if (!lines_.take(clock.now())) {
    ++untold_;
    return false;
  }
  if (untold_ > 0) spdlog::info("{} lines of this kind were left out", std::exchange(untold_, 0));
  return true;
}

std::optional<Known> Gateway::who(std::string_view cookie, const std::string& certificate, bool encrypted,
                                  bool is_use) {
  if (const auto token = cookie_of(cookie, cookie_name(encrypted))) {
    const auto* session = is_use ? sessions.use(*token, clock.now()) : sessions.look(*token, clock.now());
    if (session != nullptr) return Known{.person = session->person, .session = session->id};
  }
  if (!certificate.empty() && identities_) return by_certificate(certificate);
  if (!encrypted && people.nobody())
    return Known{.person = {.name = "loopback", .role = "", .how = How::loopback}};
  return std::nullopt;
}

std::optional<Known> Gateway::by_certificate(const std::string& certificate) const {
  auto name = identities_->of(certificate);
  if (!is_user_name(name)) return std::nullopt;
  std::string role(role_of_certificate(people.users(), name));
  return Known{.person = {.name = std::move(name), .role = std::move(role), .how = How::certificate}};
}

Upstream* Gateway::machine(std::string_view name) const {
  const auto found = machines.find(name);
  return found == machines.end() ? nullptr : found->second.get();
}

std::string Gateway::trouble() const {
  for (const auto& [name, upstream] : machines)
    if (const auto trouble = upstream->trouble(); !trouble.empty())
      return name.empty() ? trouble : fmt::format("{}: {}", name, trouble);
  return {};
}

void Gateway::enter(const std::shared_ptr<Guest>& guest) {
  std::erase_if(guests_, [](const auto& known) { return known.expired(); });
  guests_.push_back(guest);
}

std::vector<std::shared_ptr<Guest>> Gateway::guests() {
  std::vector<std::shared_ptr<Guest>> alive;
  for (const auto& guest : guests_)
    if (auto one = guest.lock()) alive.push_back(std::move(one));
  return alive;
}

bool Gateway::make_room() {
  std::shared_ptr<Guest> idlest;
  for (const auto& guest : guests())
    if (const auto since = guest->idle_since(); since && (!idlest || *since < *idlest->idle_since()))
      idlest = guest;
  if (idlest) idlest->close();
  return idlest != nullptr;
}

void Gateway::end_session(std::uint64_t id) {
  for (const auto& guest : guests())
    if (guest->session() == id) guest->close();
}

void Gateway::end_all() {
  for (const auto& guest : guests()) guest->close();
}

bool Gateway::deserted() {
  return guests().empty() &&
         std::ranges::all_of(machines, [](const auto& machine) { return machine.second->open() == 0; });
}

}  // namespace axisd::web
