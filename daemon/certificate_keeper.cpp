#include "daemon/certificate_keeper.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "api/tls/time_text.hpp"
#include "daemon/store/thread.hpp"

namespace axisd {
namespace {

constexpr auto looked_at_every = std::chrono::seconds(1);
/// Files that were not usable are looked at again although they have not changed: they may be valid by now.
constexpr auto tried_again_after = std::chrono::minutes(1);
constexpr auto reminded_every = std::chrono::minutes(1);

std::vector<std::string> watched(const tls::Live* live) {
  if (live == nullptr) return {};
  const auto& paths = live->paths();
  std::vector<std::string> all{paths.certificate, paths.key, paths.client_ca};
  if (!paths.crl.empty()) all.push_back(paths.crl);
  return all;
}

}  // namespace

CertificateKeeper::CertificateKeeper(std::shared_ptr<tls::Live> live, Tell tell)
    : live_(std::move(live)), tell_(std::move(tell)), watch_(watched(live_.get())) {}

CertificateKeeper::~CertificateKeeper() { close(); }

void CertificateKeeper::start() {
  if (live_) thread_ = store::start_thread("axisd-certs", [this] { run(); });
}

void CertificateKeeper::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void CertificateKeeper::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    lock.unlock();
    look(std::chrono::system_clock::now(), monotonic_now());
    lock.lock();
    wake_.wait_for(lock, looked_at_every, [this] { return closing_; });
  }
}

void CertificateKeeper::look(WallTime wall, TimePoint now) {
  bool due = watch_.settled();
  {
    const std::lock_guard lock(reloading_);
    due = due || (retry_ && *retry_ <= now);
  }
  if (due) reload(wall, now);
  remind(wall, now);
}

void CertificateKeeper::reload(WallTime wall, TimePoint now) {
  if (!live_) return;
  const std::lock_guard lock(reloading_);
  const auto replaced = live_->reload(wall);
  if (!replaced) {
    retry_ = now + tried_again_after;
    // The remedy may say what time it is.
    const auto& message = replaced.error().message;
    if (std::exchange(complaint_, message) == message) return;
    auto text = fmt::format("server.tls: {}; what was served before stays", to_string(replaced.error()));
    spdlog::error("{}", text);
    return tell_({.what = CertificateNotice::What::not_replaced, .text = std::move(text)});
  }
  retry_.reset();
  complaint_.clear();
  if (!*replaced) return;
  const auto expires = tls::first_expiry(live_->served()->contents.certificate);
  auto text = fmt::format("server.tls: the files were replaced and are served to new connections, until {}",
                          tls::to_text(expires));
  spdlog::info("{}", text);
  tell_({.what = CertificateNotice::What::replaced, .expires = expires, .text = std::move(text)});
}

void CertificateKeeper::remind(WallTime wall, TimePoint now) {
  using What = CertificateNotice::What;
  if (now < remind_at_) return;
  remind_at_ = now + reminded_every;
  const auto contents = live_->served();
  for (auto& notice : reminder_.due(tls::expiries(live_->paths(), contents->contents, wall), wall, now)) {
    spdlog::warn("{}", notice.text);
    tell_({.what = notice.over ? What::expired : What::expires_soon,
           .path = std::move(notice.path),
           .expires = notice.at,
           .text = std::move(notice.text)});
  }
}

}  // namespace axisd
