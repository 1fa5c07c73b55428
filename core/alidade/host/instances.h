// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade {
class ModelInstance;
}

/// All instances of models that there are, for the words about a call that does not return.
namespace alidade::internal {

void AddInstance(const ModelInstance& model);
void DropInstance(const ModelInstance& model);

}  // namespace alidade::internal
