#include "posix/socket_errors.hpp"

#include <fmt/format.h>
#include <netdb.h>

#include <cerrno>
#include <system_error>

namespace spindle::posix {
namespace {

std::string words(int error_number) { return std::generic_category().message(error_number); }

}  // namespace

Error connect_error(int error_number) {
  switch (error_number) {
    case ECONNREFUSED:
      return {.code = Errc::connection_refused};
    case ETIMEDOUT:
      return {.code = Errc::connect_timeout};
    case ENETUNREACH:
    case EHOSTUNREACH:
    case EHOSTDOWN:
    case ENETDOWN:
      return {.code = Errc::no_route};
    case EMFILE:
    case ENFILE:
    case ENOBUFS:
    case ENOMEM:
      return {.code = Errc::internal,
              .message = "cannot open a socket: " + words(error_number),
              .hint = "close other programs, or raise the limit that 'ulimit -n' shows"};
    default:
      return {.code = Errc::no_route, .message = "cannot connect: " + words(error_number)};
  }
}

Error stream_error(int error_number) {
  switch (error_number) {
    case ECONNRESET:
    case EPIPE:
      return {.code = Errc::reset, .message = "connection reset by the tool"};
    case ETIMEDOUT:
      return {.code = Errc::reset,
              .message = "the connection broke: the tool no longer acknowledges what is sent"};
    default:
      return {.code = Errc::reset, .message = "the connection broke: " + words(error_number)};
  }
}

Error listen_error(int error_number, const std::string& where) {
  if (error_number == EADDRINUSE) {
    return {.code = Errc::port_busy,
            .message = where + " is already in use",
            .hint = "choose another port, or 0 for any that is free"};
  }
  return {.code = Errc::port_unusable,
          .message = fmt::format("cannot listen on {}: {}", where, words(error_number)),
          .hint = "choose an address of this computer and a port above 1023"};
}

Error resolve_error(int status, int error_number, const std::string& host) {
  Error error = {.code = Errc::name_not_found};
  switch (status) {
    case EAI_NONAME:
    case EAI_NODATA:
    case EAI_ADDRFAMILY:
      error.message = fmt::format("no address for '{}'", host);
      break;
    case EAI_AGAIN:
      error.message = fmt::format("no address for '{}': the name server does not answer", host);
      error.hint = "check the network, or use the tool's IP address";
      break;
    case EAI_SYSTEM:
      error.message = fmt::format("no address for '{}': {}", host, words(error_number));
      break;
    default:
      error.message = fmt::format("no address for '{}': {}", host, ::gai_strerror(status));
  }
  return error;
}

}  // namespace spindle::posix
