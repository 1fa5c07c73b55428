# SPDX-License-Identifier: Apache-2.0

# The target `docs`: HTML in docs/ of the build folder; see scripts/check-docs for what it refuses.
add_custom_target(docs COMMAND ${PROJECT_SOURCE_DIR}/scripts/check-docs ${PROJECT_BINARY_DIR}/docs
                  USES_TERMINAL VERBATIM)
