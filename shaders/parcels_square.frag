// Parcels of a few pixels: squares, with the disc's coverage in alpha. Half the cost of discs.
in vec4 point_color;
out vec4 color;
void main() { color = point_color; }
