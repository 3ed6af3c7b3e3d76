// Exit status 0 if Bullet's library rounds each product before it adds it, 1 if it was compiled
// with fused multiply-add. The inertia of a box is a sum of two products, computed in the library.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

int main() {
  for (int i = 0; i < 64; ++i) {
    const btScalar size = 1 + btScalar(i) / 100;
    const btBoxShape box(btVector3(1, size, size / 3));
    const btVector3 half = box.getHalfExtentsWithMargin();
    const volatile btScalar y = 4 * half.y() * half.y(), z = 4 * half.z() * half.z();
    const volatile btScalar sum = y + z;
    btVector3 inertia;
    box.calculateLocalInertia(12, inertia);
    if (inertia.x() != sum) return 1;
  }
  return 0;
}
