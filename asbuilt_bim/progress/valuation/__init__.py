"""What is paid: the bill of a visit, from what photos say and from what persons have written."""
