# SPDX-License-Identifier: Apache-2.0

# Target `docs`: writes HTML to docs/ in the build folder, and checks the documentation.
# scripts/check-docs lists the checks.
add_custom_target(docs COMMAND ${PROJECT_SOURCE_DIR}/scripts/check-docs ${PROJECT_BINARY_DIR}/docs
                  USES_TERMINAL VERBATIM)
