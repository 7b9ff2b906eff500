// Three-point bending beam, 400 x 100 mm: gmsh -2 -setnumber h 2 -format inp
// The supports, the middle of the span and the ends of the loaded patch are nodes.
DefineConstant[ h = 2 ];
SetFactory("Built-in");
Point(1) = {  0,   0, 0, h};
Point(2) = { 50,   0, 0, h};   // pin
Point(3) = {200,   0, 0, h};   // middle of the span
Point(4) = {350,   0, 0, h};   // roller
Point(5) = {400,   0, 0, h};
Point(6) = {400, 100, 0, h};
Point(7) = {210, 100, 0, h};   // loaded patch, right end
Point(8) = {190, 100, 0, h};   // loaded patch, left end
Point(9) = {  0, 100, 0, h};
For i In {1:9}
  Line(i) = {i, i % 9 + 1};
EndFor
Curve Loop(1) = {1:9};
Plane Surface(1) = {1};
Physical Surface("ROCK") = {1};
Mesh.Algorithm = 6;            // frontal Delaunay
Mesh.Smoothing = 10;
