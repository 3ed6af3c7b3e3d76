in vec3 ray;
layout(location = 0) out vec4 result;

void main() { result = vec4(sky(normalize(ray)), 1.0); }
