#include "spindle/base/trust.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "spindle/base/text.hpp"

namespace spindle {
namespace {

constexpr unsigned root = 0;

std::string shown(const Account& account) {
  return account.name.empty() ? std::to_string(account.number) : account.name;
}

bool is_believed(const Account& owner, const Trust& trust) {
  if (owner.number == root || owner.number == trust.self) return true;
  return std::any_of(trust.others.begin(), trust.others.end(), [&](const std::string& user) {
    return user == std::to_string(owner.number) || (!owner.name.empty() && user == owner.name);
  });
}

/// As many systems give one to each user.
bool is_private(const Ownership& ownership) {
  const std::string& owner = ownership.owner.name;
  const auto& members = ownership.members;
  return !owner.empty() && ownership.group.name == owner &&
         std::all_of(members.begin(), members.end(),
                     [&](const std::string& member) { return member == owner; });
}

Error refusal(const std::string& path, std::string why, std::string hint) {
  return {.code = Errc::bad_file,
          .message = "it is not read, because " + std::move(why),
          .hint = std::move(hint),
          .name = path};
}

}  // namespace

Result<void> check_trust(const std::string& path, const Ownership& ownership, const Trust& trust) {
  if (trust.everyone) return {};
  if (!is_believed(ownership.owner, trust)) {
    const std::string owner = shown(ownership.owner);
    return tl::unexpected(refusal(
        path, fmt::format("it belongs to {}, neither to you nor to root", owner),
        fmt::format("set SPINDLE_TRUST={} if this user may decide what your tools do", owner)));
  }
  if (ownership.others_write) {
    return tl::unexpected(
        refusal(path, "every user can change it", fmt::format("'chmod o-w {}' ends that", path)));
  }
  if (ownership.group_writes && !is_private(ownership)) {
    return tl::unexpected(refusal(
        path, fmt::format("every member of the group {} can change it", shown(ownership.group)),
        fmt::format("'chmod g-w {}' ends that", path)));
  }
  return {};
}

std::vector<std::string> trusted_users(std::string_view text) {
  std::vector<std::string> users;
  for (const std::string_view user : split(text, ',')) {
    if (!user.empty()) users.emplace_back(user);
  }
  return users;
}

}  // namespace spindle
