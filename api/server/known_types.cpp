#include "api/server/known_types.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <algorithm>

namespace axisd::server {
namespace {

namespace pb = google::protobuf;

void leave_options_out(pb::Type& type) {
  const auto is_of_map = [](const pb::Option& option) { return option.name() == "map_entry"; };
  if (std::none_of(type.options().begin(), type.options().end(), is_of_map)) type.clear_options();
  for (auto& field : *type.mutable_fields()) field.clear_options();
}

void leave_options_out(pb::Enum& type) {
  type.clear_options();
  for (auto& value : *type.mutable_enumvalue()) value.clear_options();
}

/// What `known` has of that name; else what `describe` says, from then on. Precondition: nobody else uses
/// `known`.
template <class Type, class Describe>
pb::util::Status look_up(std::unordered_map<std::string, Type>& known, const std::string& url, Type& type,
                         const Describe& describe) {
  auto found = known.find(url);
  if (found == known.end()) {
    Type described;
    if (auto status = describe(&described); !status.ok()) return status;
    leave_options_out(described);
    found = known.emplace(url, std::move(described)).first;
  }
  type = found->second;
  return {};
}

}  // namespace

KnownTypes::KnownTypes()
    : described_(pb::util::NewTypeResolverForDescriptorPool(prefix, pb::DescriptorPool::generated_pool())) {}

pb::util::Status KnownTypes::ResolveMessageType(const std::string& url, pb::Type* type) {
  const std::scoped_lock lock(mutex_);
  return look_up(messages_, url, *type,
                 [&](pb::Type* described) { return described_->ResolveMessageType(url, described); });
}

pb::util::Status KnownTypes::ResolveEnumType(const std::string& url, pb::Enum* type) {
  const std::scoped_lock lock(mutex_);
  return look_up(enums_, url, *type,
                 [&](pb::Enum* described) { return described_->ResolveEnumType(url, described); });
}

}  // namespace axisd::server
