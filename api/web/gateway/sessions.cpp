#include "api/web/gateway/sessions.hpp"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <utility>

namespace axisd::web {
namespace {

constexpr std::size_t token_bytes = 32;

std::string new_token() {
  std::array<unsigned char, token_bytes> random{};
  randombytes_buf(random.data(), random.size());
  std::string hex(2 * random.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), random.data(), random.size());
  hex.pop_back();
  return hex;
}

/// How long a search takes tells nothing about the tokens that there are.
std::string hash_of(std::string_view token) {
  std::string hash(crypto_generichash_BYTES, '\0');
  crypto_generichash(reinterpret_cast<unsigned char*>(hash.data()), hash.size(),
                     reinterpret_cast<const unsigned char*>(token.data()), token.size(), nullptr, 0);
  return hash;
}

}  // namespace

std::string Sessions::begin(Person person, std::string peer, std::string proof, TimePoint now) {
  expire(now);
  make_room(person);
  auto token = new_token();
  sessions_.emplace(hash_of(token), Session{.id = ++last_id_,
                                            .person = std::move(person),
                                            .peer = std::move(peer),
                                            .proof = std::move(proof),
                                            .begun = now,
                                            .used = now});
  return token;
}

void Sessions::make_room(const Person& person) {
  const auto longest_idle = [&](auto counts) {
    auto idlest = sessions_.end();
    std::size_t count = 0;
    for (auto session = sessions_.begin(); session != sessions_.end(); ++session) {
      if (!counts(session->second)) continue;
      ++count;
      if (idlest == sessions_.end() || session->second.used < idlest->second.used) idlest = session;
    }
    return std::pair(idlest, count);
  };
  if (const auto [own, count] = longest_idle([&](const Session& s) { return s.person.name == person.name; });
      count >= limits_.most_each)
    erase(own);
  if (const auto [any, count] = longest_idle([](const Session&) { return true; }); count >= limits_.most)
    erase(any);
}

Sessions::Table::iterator Sessions::find(std::string_view token, TimePoint now) {
  if (token.size() != 2 * token_bytes) return sessions_.end();
  const auto found = sessions_.find(hash_of(token));
  if (found == sessions_.end() || end_of(found->second) > now) return found;
  erase(found);
  return sessions_.end();
}

const Session* Sessions::use(std::string_view token, TimePoint now) {
  const auto found = find(token, now);
  if (found == sessions_.end()) return nullptr;
  found->second.used = now;
  return &found->second;
}

const Session* Sessions::look(std::string_view token, TimePoint now) {
  const auto found = find(token, now);
  return found == sessions_.end() ? nullptr : &found->second;
}

void Sessions::touch(std::uint64_t id, TimePoint now) {
  const auto found = std::ranges::find(sessions_, id, [](const auto& entry) { return entry.second.id; });
  if (found != sessions_.end() && end_of(found->second) > now) found->second.used = now;
}

bool Sessions::end(std::uint64_t id) {
  const auto found = std::ranges::find(sessions_, id, [](const auto& entry) { return entry.second.id; });
  if (found == sessions_.end()) return false;
  erase(found);
  return true;
}

void Sessions::end_if(const std::function<bool(const Session&)>& doomed) {
  for (auto session = sessions_.begin(); session != sessions_.end();)
    session = doomed(session->second) ? erase(session) : std::next(session);
}

void Sessions::expire(TimePoint now) {
  end_if([&](const Session& session) { return end_of(session) <= now; });
}

Sessions::Table::iterator Sessions::erase(Table::iterator session) {
  const auto ended = std::move(session->second);
  const auto next = sessions_.erase(session);
  if (ended_) ended_(ended);
  return next;
}

std::vector<Session> Sessions::list() const {
  std::vector<Session> all;
  for (const auto& [hash, session] : sessions_) all.push_back(session);
  std::ranges::sort(all, {}, &Session::id);
  return all;
}

TimePoint Sessions::end_of(const Session& session) const {
  return std::min(session.used + limits_.idle, session.begun + limits_.longest);
}

}  // namespace axisd::web
