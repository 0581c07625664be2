#pragma once

#include <google/protobuf/type.pb.h>
#include <google/protobuf/util/type_resolver.h>

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

namespace axisd::server {

/// The types of this program's messages as protobuf's JSON asks for them: anew for each message that it
/// prints. Here each is described once, without the options, of which it needs those of maps alone. Thread:
/// any.
class KnownTypes final : public google::protobuf::util::TypeResolver {
 public:
  /// Of google.protobuf.Any: "URL/PACKAGE.MESSAGE".
  static constexpr const char* prefix = "type.googleapis.com";

  KnownTypes();
  google::protobuf::util::Status ResolveMessageType(const std::string& url,
                                                    google::protobuf::Type* type) override;
  google::protobuf::util::Status ResolveEnumType(const std::string& url,
                                                 google::protobuf::Enum* type) override;

 private:
  const std::unique_ptr<TypeResolver> described_;
  std::mutex mutex_;
  std::unordered_map<std::string, google::protobuf::Type> messages_;  // guarded by mutex_
  std::unordered_map<std::string, google::protobuf::Enum> enums_;     // guarded by mutex_
};

}  // namespace axisd::server
