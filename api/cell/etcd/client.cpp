#include "api/cell/etcd/client.hpp"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/support/channel_arguments.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "buses/limited_log.hpp"
#include "config/text.hpp"

namespace axisd::cell::etcd {
namespace {

constexpr Duration patience = std::chrono::milliseconds(2500);
constexpr std::int64_t most_machines = 1024;
/// Without it a member that is cut off from the others would say nothing, for ever.
const Metadata with_leader{{"hasleader", "true"}};

grpc::ChannelArguments arguments() {
  grpc::ChannelArguments arguments;
  // etcd answers pings that come faster than every 5 s with GOAWAY; progress is asked for instead.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
}

std::string text_of(const grpc::Status& status) {
  return fmt::format("{} ({})", config::printable(status.error_message(), 200),
                     static_cast<int>(status.error_code()));
}

}  // namespace

Client::Client(boost::asio::any_io_executor core, std::vector<std::string> endpoints,
               std::shared_ptr<grpc::ChannelCredentials> trusted, std::string_view cell, Events events)
    : core_(std::move(core)),
      endpoints_(std::move(endpoints)),
      trusted_(std::move(trusted)),
      keys_(cell),
      events_(std::move(events)) {}

Client::~Client() { leave(); }

void Client::leave() {
  const auto look = std::move(look_);
  look_.reset();
  if (!look) return;
  if (look->watch) look->watch->end();
  if (look->lease) look->lease->end();
}

void Client::lose(std::string why) {
  if (!look_) return;
  auto text = fmt::format("etcd at {}: {}", look_->endpoint, why);
  leave();
  events_.lost(std::move(text));
}

template <class Response, class Done>
void Client::ask_endpoint(const char* path, const google::protobuf::MessageLite& request, Done done) {
  if (!look_) return;  // left meanwhile, as whoever asks is told
  ask<Response>(core_, look_->channel, {.path = path, .timeout = patience, .metadata = with_leader}, request,
                [this, look = std::weak_ptr(look_), done = std::move(done)](const grpc::Status& status,
                                                                            const Response& response) {
                  if (look.expired() || look.lock() != look_) return;
                  if (!status.ok()) return lose(text_of(status));
                  done(response);
                });
}

void Client::look(std::size_t endpoint) {
  leave();
  look_ = std::make_shared<Look>();
  look_->endpoint = endpoints_.at(endpoint);
  look_->channel = grpc::CreateCustomChannel(look_->endpoint, trusted_, arguments());
  list();
}

void Client::list() {
  etcdserverpb::RangeRequest request;
  request.set_key(keys_.prefix());
  request.set_range_end(keys_.prefix_end());
  request.set_limit(most_machines + 1);
  ask_endpoint<etcdserverpb::RangeResponse>(
      "/etcdserverpb.KV/Range", request, [this](const etcdserverpb::RangeResponse& response) {
        std::vector<kept::Registration> machines;
        Versioned stop_all;
        for (const auto& kv : response.kvs()) {
          if (kv.key() == keys_.stop_all()) stop_all = {.value = kv.value(), .revision = kv.mod_revision()};
          const auto name = keys_.machine_of(kv.key());
          auto registration = name ? registration_of(*name, kv.value()) : std::nullopt;
          if (registration)
            machines.push_back(*std::move(registration));
          else if (kv.key() != keys_.stop_all())
            log_limited(spdlog::level::warn, "etcd", "keys",
                        fmt::format("the key {} is not usable", config::quoted(kv.key())));
        }
        const std::weak_ptr look(look_);
        watch_from(response.header().revision() + 1);
        events_.stop_all(stop_all);
        if (!look.expired()) events_.listed(std::move(machines));
      });
}

void Client::watch_from(std::int64_t revision) {
  const std::weak_ptr look(look_);
  look_->watch = Talk::begin(core_, look_->channel, "/etcdserverpb.Watch/Watch", with_leader,
                             {.message = [this](const grpc::ByteBuffer& bytes) { on_watched(bytes); },
                              .done = [this](const grpc::Status& status) { lose(text_of(status)); }});
  etcdserverpb::WatchRequest request;
  auto& create = *request.mutable_create_request();
  create.set_key(keys_.prefix());
  create.set_range_end(keys_.prefix_end());
  create.set_start_revision(revision);
  look_->watch->say(request);
}

void Client::on_watched(const grpc::ByteBuffer& bytes) {
  etcdserverpb::WatchResponse response;
  if (!from_buffer(bytes, response)) return lose("an answer that cannot be read");
  if (response.canceled())
    return lose(fmt::format("the watch was ended: {}", config::printable(response.cancel_reason(), 200)));
  events_.heard();
  const std::weak_ptr look(look_);
  for (const auto& event : response.events()) {
    if (look.expired()) return;
    on_event(event);
  }
}

void Client::on_event(const etcdserverpb::Event& event) {
  const auto& kv = event.kv();
  const bool gone = event.type() == etcdserverpb::Event::DELETE;
  if (kv.key() == keys_.stop_all())
    return events_.stop_all(gone ? Versioned()
                                 : Versioned{.value = kv.value(), .revision = kv.mod_revision()});
  const auto name = keys_.machine_of(kv.key());
  if (!name) return;
  auto registration = gone ? std::nullopt : registration_of(*name, kv.value());
  if (!gone && !registration)
    log_limited(spdlog::level::warn, "etcd", "keys",
                fmt::format("the key {} is not usable", config::quoted(kv.key())));
  events_.changed(*name, std::move(registration));
}

void Client::grant(Duration ttl) {
  etcdserverpb::LeaseGrantRequest request;
  request.set_ttl(std::chrono::duration_cast<std::chrono::seconds>(ttl).count());
  ask_endpoint<etcdserverpb::LeaseGrantResponse>("/etcdserverpb.Lease/LeaseGrant", request,
                                                 [this](const etcdserverpb::LeaseGrantResponse& response) {
                                                   if (!response.error().empty())
                                                     return lose(config::printable(response.error(), 200));
                                                   events_.granted(response.id());
                                                 });
}

void Client::write(std::int64_t lease, const kept::Registration& own) {
  etcdserverpb::Compare nobody;
  nobody.set_result(etcdserverpb::Compare::EQUAL);
  nobody.set_target(etcdserverpb::Compare::CREATE);
  nobody.set_create_revision(0);
  put(lease, own, nobody);
}

void Client::put(std::int64_t lease, const kept::Registration& own, etcdserverpb::Compare condition) {
  etcdserverpb::TxnRequest request;
  condition.set_key(keys_.of_machine(own.name()));
  *request.add_compare() = condition;
  auto& success = *request.add_success()->mutable_request_put();
  success.set_key(condition.key());
  success.set_value(own.SerializeAsString());
  success.set_lease(lease);
  request.add_failure()->mutable_request_range()->set_key(condition.key());
  ask_endpoint<etcdserverpb::TxnResponse>(
      "/etcdserverpb.KV/Txn", request,
      [this, lease, own](const etcdserverpb::TxnResponse& response) { on_written(lease, own, response); });
}

void Client::on_written(std::int64_t lease, const kept::Registration& own,
                        const etcdserverpb::TxnResponse& response) {
  if (response.succeeded()) return events_.written();
  const bool found = response.responses_size() == 1 && response.responses(0).response_range().kvs_size() == 1;
  if (!found) return write(lease, own);  // it went meanwhile
  const auto& kv = response.responses(0).response_range().kvs(0);
  // What nobody can read has no holder who could be named.
  kept::Registration unreadable;
  unreadable.set_name(own.name());
  const auto holder = registration_of(own.name(), kv.value()).value_or(unreadable);
  if (holder.machine_id() != own.machine_id()) return events_.held(holder);
  etcdserverpb::Compare unchanged;
  unchanged.set_result(etcdserverpb::Compare::EQUAL);
  unchanged.set_target(etcdserverpb::Compare::MOD);
  unchanged.set_mod_revision(kv.mod_revision());
  put(lease, own, unchanged);
}

void Client::keep_alive(std::int64_t lease) {
  if (!look_) return;
  etcdserverpb::LeaseKeepAliveRequest request;
  request.set_id(lease);
  if (!look_->lease)
    look_->lease = Talk::begin(core_, look_->channel, "/etcdserverpb.Lease/LeaseKeepAlive", with_leader,
                               {.message =
                                    [this](const grpc::ByteBuffer& bytes) {
                                      etcdserverpb::LeaseKeepAliveResponse response;
                                      if (!from_buffer(bytes, response))
                                        return lose("an answer that cannot be read");
                                      events_.kept_alive(response.ttl() > 0);
                                    },
                                .done = [this](const grpc::Status& status) { lose(text_of(status)); }});
  look_->lease->say(request);
}

void Client::ask_progress() {
  if (!look_ || !look_->watch) return;
  etcdserverpb::WatchRequest request;
  request.mutable_progress_request();
  look_->watch->say(request);
}

void Client::revoke(std::int64_t lease, std::function<void()> done) {
  if (!look_ || lease == 0) return done();
  etcdserverpb::LeaseRevokeRequest request;
  request.set_id(lease);
  ask<etcdserverpb::LeaseRevokeResponse>(
      core_, look_->channel,
      {.path = "/etcdserverpb.Lease/LeaseRevoke", .timeout = std::chrono::seconds(1), .metadata = {}},
      request,
      [done = std::move(done)](const grpc::Status&, const etcdserverpb::LeaseRevokeResponse&) { done(); });
}

void Client::replace_stop_all(std::string value, std::int64_t revision, std::function<void(Replaced)> done) {
  if (!look_) return done({.error = "no endpoint of etcd answers"});
  etcdserverpb::TxnRequest request;
  auto& compare = *request.add_compare();
  compare.set_result(etcdserverpb::Compare::EQUAL);
  compare.set_target(etcdserverpb::Compare::MOD);
  compare.set_key(keys_.stop_all());
  compare.set_mod_revision(revision);
  auto& put = *request.add_success()->mutable_request_put();
  put.set_key(keys_.stop_all());
  put.set_value(std::move(value));
  request.add_failure()->mutable_request_range()->set_key(keys_.stop_all());
  ask<etcdserverpb::TxnResponse>(
      core_, look_->channel, {.path = "/etcdserverpb.KV/Txn", .timeout = patience, .metadata = {}}, request,
      [done = std::move(done)](const grpc::Status& status, const etcdserverpb::TxnResponse& response) {
        if (!status.ok()) return done({.error = text_of(status)});
        if (response.succeeded()) return done({});
        Versioned other;
        if (response.responses_size() == 1 && response.responses(0).response_range().kvs_size() == 1) {
          const auto& kv = response.responses(0).response_range().kvs(0);
          other = {.value = kv.value(), .revision = kv.mod_revision()};
        }
        done({.other = std::move(other)});
      });
}

}  // namespace axisd::cell::etcd
