#include "postgres_address.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string_view>

#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

using Words = std::map<std::string, std::string, std::less<>>;

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { ::PQconninfoFree(options); }
};

Error unreadable() {
  return {.code = Errc::usage,
          .message = "this is no URL of a PostgreSQL database",
          .hint = "write postgresql://[USER@]HOST[:PORT]/DATABASE[?sslrootcert=FILE]"};
}

/// What libpq says of a URL that it cannot read quotes parts of it, perhaps a password.
Result<Words> read_url(const std::string& url) {
  char* said = nullptr;
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(
      ::PQconninfoParse(url.c_str(), &said));
  ::PQfreemem(said);
  if (!options) return tl::unexpected(unreadable());
  Words words;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (option->val != nullptr) words[option->keyword] = option->val;
  }
  for (const char* secret : {"password", "sslpassword"}) {
    if (!words.contains(secret)) continue;
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = "a URL with a password is not taken: every user of this computer and "
                         "every log could read it",
              .hint = "give the sink a 'password-file', or use ~/.pgpass (PGPASSFILE)"});
  }
  return words;
}

std::string value_of(const Words& words, std::string_view key) {
  const auto found = words.find(key);
  return found == words.end() ? std::string() : found->second;
}

bool is_this_computer(std::string_view host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.") ||
         host.starts_with('/') || host.starts_with('@');
}

/// Whether every host that is tried is this computer, as far as the URL says.
bool stays_here(const Words& words) {
  const std::string hosts = value_of(words, "host");
  const std::string addresses = value_of(words, "hostaddr");
  if (hosts.empty() && addresses.empty()) return false;
  for (const std::string& list : {hosts, addresses}) {
    const auto parts = split(list, ',');
    if (!list.empty() && !std::ranges::all_of(parts, is_this_computer)) return false;
  }
  return true;
}

void add_files(Words& words, const files::Sink& settings) {
  const auto add = [&](const char* key, const std::string& value) {
    if (!value.empty()) words[key] = value;
  };
  add("user", settings.user);
  add("sslrootcert", settings.ca_file);
  add("sslcert", settings.cert_file);
  add("sslkey", settings.key_file);
}

/// Returns what the user should know of how the server's certificate is checked.
std::string settle_tls(Words& words, const files::Sink& settings) {
  const std::string mode = value_of(words, "sslmode");
  const bool here = stays_here(words);
  if (mode.empty()) {
    if (!here || !settings.ca_file.empty()) words["sslmode"] = "verify-full";
    return {};
  }
  if (here || mode == "verify-full") return {};
  return fmt::format("sslmode={} stands in the URL: the name of the server {}", mode,
                     mode == "verify-ca" ? "is not checked"
                                         : "and its certificate are not checked, and another "
                                           "computer could read along");
}

std::string shown_place(const Words& words) {
  const std::string host = value_of(words, "host");
  const std::string address = value_of(words, "hostaddr");
  const std::string port = value_of(words, "port");
  const std::string service = value_of(words, "service");
  std::string shown = !host.empty() ? host : address;
  if (shown.empty() && !service.empty()) shown = fmt::format("service {}", service);
  if (shown.empty()) shown = "this computer";
  if (!port.empty()) shown += ":" + port;
  const std::string database = value_of(words, "dbname");
  return database.empty() ? shown : fmt::format("{}/{}", shown, database);
}

}  // namespace

Result<PostgresAddress> postgres_address(const std::string& url, const files::Sink& settings,
                                         const std::optional<std::string>& password) {
  TRY_LET(Words words, read_url(url));
  PostgresAddress address{.shown = shown_place(words)};
  const std::string hosts = value_of(words, "host");
  address.hosts = 1 + static_cast<std::size_t>(std::ranges::count(hosts, ','));
  add_files(words, settings);
  address.caution = settle_tls(words, settings);
  // Without these a partition in which nothing is heard lasts for hours. As for the tools.
  const std::pair<const char*, const char*> usual[] = {
      {"connect_timeout", "10"}, {"keepalives", "1"},
      {"keepalives_idle", "5"},  {"keepalives_interval", "2"},
      {"keepalives_count", "3"}, {"tcp_user_timeout", "10000"},
      {"gssencmode", "disable"}, {"application_name", "spindle"}};
  for (const auto& [key, value] : usual) words.try_emplace(key, value);
  words["client_encoding"] = "UTF8";
  if (password) words["password"] = *password;
  address.words.assign(words.begin(), words.end());
  return address;
}

Result<std::vector<PostgresAddress>> postgres_addresses(
    const files::Sink& settings, const std::optional<std::string>& password) {
  std::vector<PostgresAddress> addresses;
  for (const std::string& url : settings.urls) {
    TRY_LET(auto address, postgres_address(url, settings, password));
    addresses.push_back(std::move(address));
  }
  return addresses;
}

}  // namespace spindle::forward
