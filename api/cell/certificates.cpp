#include "api/cell/certificates.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "api/transport/channel.hpp"

namespace axisd::cell {
namespace {

constexpr Duration look_period = std::chrono::seconds(1);

std::vector<std::string> paths_of(const Settings& settings) {
  std::vector<std::string> paths;
  const auto add = [&](const std::string& path) {
    if (!path.empty()) paths.push_back(path);
  };
  if (settings.tls)
    for (const auto& path :
         {settings.tls->certificate, settings.tls->key, settings.tls->client_ca, settings.tls->crl})
      add(path);
  for (const auto& files : {settings.axisd.tls, settings.etcd.tls})
    for (const auto& path : {files.ca, files.certificate, files.key}) add(path);
  return paths;
}

std::string content_of(const std::string& path) {
  const std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Of one section of the configuration: where its files are, and what they hold.
struct Section {
  tls::Files paths, contents;
  std::string_view certificate, authority, crl;  ///< their keys: literals
};

/// Of all that is used. Blocks for the disk.
std::vector<tls::Expiry> expiries_of(const Settings& settings, const tls::Live* live) {
  std::vector<Section> sections;
  if (live != nullptr)
    sections.push_back({.paths = live->paths(),
                        .contents = live->served()->contents,
                        .certificate = "tls.certificate",
                        .authority = "tls.client_ca",
                        .crl = "tls.crl"});
  const auto add = [&](const auto& files, std::string_view certificate, std::string_view authority) {
    if (files.certificate.empty()) return;
    sections.push_back(
        {.paths = {.certificate = files.certificate, .client_ca = files.ca},
         .contents = {.certificate = content_of(files.certificate), .client_ca = content_of(files.ca)},
         .certificate = certificate,
         .authority = authority});
  };
  add(settings.axisd.tls, "axisd.tls.certificate", "axisd.tls.ca");
  add(settings.etcd.tls, "etcd.tls.certificate", "etcd.tls.ca");
  std::vector<tls::Expiry> all;
  for (const auto& section : sections)
    for (auto expiry : tls::expiries(section.paths, section.contents, std::chrono::system_clock::now())) {
      const bool is_authority = expiry.key == "client_ca";
      if (is_authority) expiry.what = "an authority";  // all of them may be one file
      expiry.key = is_authority ? section.authority : expiry.key == "crl" ? section.crl : section.certificate;
      all.push_back(std::move(expiry));
    }
  return all;
}

/// What a look has found: on the disk's thread.
struct Found {
  std::optional<Trust> trust{};
  std::vector<tls::Expiry> expiries{};  ///< of trust
  std::optional<Error> error{};
};

}  // namespace

Certificates::Certificates(const Settings& settings, std::shared_ptr<tls::Live> live, Trust trust)
    : settings_(&settings),
      live_(std::move(live)),
      trust_(std::move(trust)),
      watch_(std::make_shared<tls::FileWatch>(paths_of(settings))),
      expiries_(expiries_of(settings, live_.get())) {
  (void)watch_->settled();
  (void)watch_->settled();
}

Result<Trust> Certificates::trust_of(const Settings& settings) {
  auto machines = transport::client_credentials(settings.axisd.tls, "axisd.tls");
  if (!machines) return fail(std::move(machines).error());
  auto etcd = transport::client_credentials(settings.etcd.tls, "etcd.tls");
  if (!etcd) return fail(std::move(etcd).error());
  return Trust{.machines = *std::move(machines), .etcd = *std::move(etcd)};
}

Result<Certificates> Certificates::read(const Settings& settings) {
  std::shared_ptr<tls::Live> live;
  if (settings.tls) {
    auto opened = tls::Live::open(*settings.tls);
    if (!opened) return fail(std::move(opened).error());
    live = *std::move(opened);
  }
  auto trust = trust_of(settings);
  if (!trust) return fail(std::move(trust).error());
  return Certificates(settings, std::move(live), *std::move(trust));
}

std::vector<std::string> Certificates::expired(WallTime now) const {
  std::vector<std::string> lines;
  for (const auto& notice : tls::Reminder().due(expiries_, now, TimePoint()))
    if (notice.over) lines.push_back(notice.text);
  return lines;
}

void Certificates::tell(spdlog::level::level_enum level, std::string text) {
  spdlog::log(level, "{}", text);
  v1::CellEvent event;
  event.set_kind(v1::CELL_EVENT_KIND_CERTIFICATE);
  event.set_text(std::move(text));
  cell_->events().tell(std::move(event));
}

void Certificates::remind() {
  const auto now = clock_->now();
  for (auto& notice : reminder_.due(expiries_, clock_->wall(now), now))
    tell(notice.over ? spdlog::level::err : spdlog::level::warn, std::move(notice.text));
}

void Certificates::keep(Clock& clock, Cell& cell) {
  clock_ = &clock;
  cell_ = &cell;
  if (!paths_of(*settings_).empty()) look();
}

void Certificates::look() {
  timer_ = clock_->call_at(clock_->now() + look_period, [this] { look(); });
  remind();
  const auto found = std::make_shared<Found>();
  cell_->disk().run(
      [found, watch = watch_, live = live_, settings = settings_] {
        if (!watch->settled()) return;
        if (live) {
          if (auto read = live->reload(); !read) found->error = read.error();
        }
        auto trust = trust_of(*settings);
        if (!trust) {
          found->error = trust.error();
          return;
        }
        found->trust = *std::move(trust);
        found->expiries = expiries_of(*settings, live.get());
      },
      [this, found, cell = cell_] {
        if (found->error)
          tell(spdlog::level::err,
               fmt::format("certificates: {}; what was used before stays", to_string(*found->error)));
        if (!found->trust) return;
        if (!found->error) spdlog::info("certificates were read again");
        expiries_ = std::move(found->expiries);
        cell->trust(*found->trust);
      });
}

}  // namespace axisd::cell
