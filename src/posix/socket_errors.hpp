#pragma once

#include <string>

#include "spindle/base/error.hpp"

namespace spindle::posix {

/// Why a connection could not be made: the errno of socket() or connect() as an error.
Error connect_error(int error_number);

/// Why an open connection ended: the errno of send() or recv() as an error.
Error stream_error(int error_number);

/// Why a listening socket could not be made at `where` ("127.0.0.1 port 5000").
Error listen_error(int error_number, const std::string& where);

/// Why a name has no address: getaddrinfo()'s status, and errno where that says EAI_SYSTEM.
Error resolve_error(int status, int error_number, const std::string& host);

}  // namespace spindle::posix
