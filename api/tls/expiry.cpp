#include "api/tls/expiry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/tls/pem.hpp"

namespace axisd::tls {
namespace {

WallTime end_of(const Certificate& certificate) {
  return time_of(X509_get0_notAfter(certificate.get())).value_or(WallTime::min());
}

/// Of authorities: those that are of no use already are not missed.
WallTime next_expiry(const std::string& authorities, WallTime now) {
  const auto all = certificates("client_ca", authorities);
  if (!all) return WallTime::max();
  auto next = WallTime::max(), last = WallTime::min();
  for (const auto& authority : *all) {
    const auto end = end_of(authority);
    last = std::max(last, end);
    if (end >= now) next = std::min(next, end);
  }
  return next == WallTime::max() ? last : next;
}

WallTime next_update(const std::string& lists) {
  const auto all = revocation_lists("crl", lists);
  auto first = WallTime::max();
  if (!all) return first;
  for (const auto& list : *all)
    first = std::min(first, time_of(X509_CRL_get0_nextUpdate(list.get())).value_or(first));
  return first;
}

std::string text_of(const Expiry& expiry, WallTime now) {
  if (expiry.at < now)
    return fmt::format("{}: {} has expired ({}); renew it: the daemon reads it by itself", expiry.path,
                       expiry.what, to_text(expiry.at));
  const auto days = std::chrono::floor<std::chrono::days>(expiry.at - now).count();
  return fmt::format("{}: {} expires in {} day{} ({}); renew it: the daemon reads it by itself", expiry.path,
                     expiry.what, days, days == 1 ? "" : "s", to_text(expiry.at));
}

}  // namespace

WallTime first_expiry(const std::string& text) {
  const auto all = certificates("certificate", text);
  auto first = WallTime::max();
  if (!all) return first;
  for (const auto& certificate : *all) first = std::min(first, end_of(certificate));
  return first;
}

std::vector<Expiry> expiries(const Files& paths, const Files& contents, WallTime now) {
  std::vector<Expiry> all{{.path = paths.certificate,
                           .what = "the certificate",
                           .at = first_expiry(contents.certificate),
                           .key = "certificate"},
                          {.path = paths.client_ca,
                           .what = "an authority of the clients",
                           .at = next_expiry(contents.client_ca, now),
                           .key = "client_ca"}};
  if (!paths.crl.empty())
    all.push_back({.path = paths.crl, .what = "the CRL", .at = next_update(contents.crl), .key = "crl"});
  return all;
}

std::vector<Reminder::Notice> Reminder::due(const std::vector<Expiry>& all, WallTime wall, TimePoint now) {
  std::vector<Notice> notices;
  for (const auto& expiry : all) {
    const bool over = expiry.at < wall;
    const std::pair file(expiry.path, expiry.what);
    // Not "wall + ahead": the last time that there is has none behind it.
    if (!over && expiry.at - ahead > wall) {
      said_.erase(file);
      continue;
    }
    const auto found = said_.find(file);
    if (found != said_.end() && found->second.at == expiry.at && found->second.over == over &&
        now - found->second.when < again)
      continue;
    said_.insert_or_assign(file, Said{.at = expiry.at, .over = over, .when = now});
    notices.push_back({.over = over, .path = expiry.path, .at = expiry.at, .text = text_of(expiry, wall)});
  }
  return notices;
}

}  // namespace axisd::tls
