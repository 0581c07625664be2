#include "api/web/gateway/authority.hpp"

#include <utility>

namespace axisd::web {

bool PasswordAuthority::ask(const Credentials& credentials, Answer answer) {
  const auto* user = find_user(people_.users(), credentials.name);
  auto proof = user == nullptr ? std::string() : user->hash;
  return passwords_.compare(
      proof, credentials.secret,
      [this, name = credentials.name, proof, answer = std::move(answer)](bool fits) {
        // The file may say something else by now.
        const auto* now = find_user(people_.users(), name);
        if (!fits || now == nullptr || now->hash != proof) return answer(std::nullopt);
        answer(Admitted{.person = {.name = name, .role = now->role, .how = How::password}, .proof = proof});
      });
}

bool PasswordAuthority::stands(const Person& person, const std::string& proof) const {
  const auto* user = find_user(people_.users(), person.name);
  return user != nullptr && user->role == person.role && user->hash == proof;
}

}  // namespace axisd::web
